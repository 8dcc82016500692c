# retrograde_layer(<name> [INTERNAL] [COLD] SOURCES <file>... [ALONE <file>...] DEPENDS <layer>...
#   [PRIVATE_DEPENDS <dep>...])
#
# Makes the target retrograde_<name> of one folder. DEPENDS names the layers below it, without the
# prefix; PRIVATE_DEPENDS names outside libraries that no header of the folder shows. Headers are
# installed under include/retrograde/<folder> unless the layer is INTERNAL. A folder without sources
# yet is an INTERFACE library.
#
# With RETROGRADE_QUICK_BUILD, several SOURCES are compiled as one unit, those that are ALONE by
# themselves: most of the time goes into headers. So no two files of a folder may give one name in
# their unnamed namespaces to two things. Unlike CMake's own unity builds, the units name their files
# relative to compiler/, and ccache shares them between checkouts. A layer that is COLD takes no time that its users
# would notice: it is optimized less then, which saves a third of compiling it.
option(RETROGRADE_QUICK_BUILD "Compile several sources as one unit" OFF)
set(retrograde_files_per_unit 8)
define_property(GLOBAL PROPERTY RETROGRADE_LAYERS BRIEF_DOCS "All layers that have sources")
define_property(GLOBAL PROPERTY RETROGRADE_OUTSIDE BRIEF_DOCS "Outside libraries that they use")

function(retrograde_layer name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "INTERNAL;COLD" "" "SOURCES;ALONE;DEPENDS;PRIVATE_DEPENDS")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "retrograde_layer(${name}): unknown arguments ${arg_UNPARSED_ARGUMENTS}")
  endif()
  set(target retrograde_${name})
  list(TRANSFORM arg_DEPENDS PREPEND retrograde_)
  set(include ${PROJECT_SOURCE_DIR}/compiler)
  if(arg_SOURCES OR arg_ALONE)
    set(units ${arg_SOURCES})
    if(RETROGRADE_QUICK_BUILD AND arg_SOURCES)
      retrograde_units(units ${name}/ ${arg_SOURCES})
    endif()
    add_library(${target} STATIC ${units} ${arg_ALONE})
    target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${include}>)
    target_link_libraries(${target} PUBLIC ${arg_DEPENDS} PRIVATE ${arg_PRIVATE_DEPENDS})
    if(RETROGRADE_QUICK_BUILD)
      # It takes what a unit includes for headers.
      target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
      if(arg_COLD)
        target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
      endif()
    endif()
    if(RETROGRADE_VALIDATE)
      target_compile_definitions(${target} PUBLIC RETROGRADE_VALIDATE=1)
    endif()
    set_property(GLOBAL APPEND PROPERTY RETROGRADE_LAYERS ${target})
    set_property(GLOBAL APPEND PROPERTY RETROGRADE_OUTSIDE ${arg_PRIVATE_DEPENDS})
  else()
    add_library(${target} INTERFACE)
    target_include_directories(${target} INTERFACE $<BUILD_INTERFACE:${include}>)
    target_link_libraries(${target} INTERFACE ${arg_DEPENDS} ${arg_PRIVATE_DEPENDS})
  endif()
  if(NOT arg_INTERNAL)
    retrograde_install_headers(${name})
  endif()
endfunction()

# retrograde_units(<result> <prefix> <file>...): units that include the files, each named after the
# prefix, from a folder among those that are searched for headers.
function(retrograde_units result prefix)
  set(units)
  list(LENGTH ARGN count)
  math(EXPR last "(${count} - 1) / ${retrograde_files_per_unit}")
  foreach(i RANGE ${last})
    math(EXPR begin "${i} * ${retrograde_files_per_unit}")
    list(SUBLIST ARGN ${begin} ${retrograde_files_per_unit} files)
    list(TRANSFORM files REPLACE "(.+)" "#include \"${prefix}\\1\"\n")
    string(CONCAT text ${files})
    set(unit ${CMAKE_CURRENT_BINARY_DIR}/${result}_${i}.cpp)
    file(CONFIGURE OUTPUT ${unit} CONTENT "${text}" @ONLY)
    list(APPEND units ${unit})
  endforeach()
  set(${result} ${units} PARENT_SCOPE)
endfunction()

function(retrograde_install_headers folder)
  install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/retrograde/${folder}
    FILES_MATCHING PATTERN "*.h" PATTERN "*.def" PATTERN "include" EXCLUDE PATTERN "compat" EXCLUDE)
endfunction()
