# retrograde_layer(<name> [INTERNAL] [COLD] SOURCES <file>... [ALONE <file>...] DEPENDS <layer>...
#   [PRIVATE_DEPENDS <dep>...])
#
# Makes the target retrograde_<name> for one folder. DEPENDS names the layers below it, without the prefix.
# PRIVATE_DEPENDS names external libraries that do not appear in the folder's headers. Headers are installed under
# include/retrograde/<folder> unless the layer is INTERNAL. A folder without sources is an INTERFACE library.
#
# With RETROGRADE_QUICK_BUILD, several SOURCES are compiled as one unit, because headers take most of the time; files
# that are ALONE are compiled by themselves. So two files of a folder must not define the same name in their unnamed
# namespaces. Unlike CMake's unity builds, the units name their files relative to compiler/, so ccache can share them
# between checkouts. A COLD layer takes no noticeable time at run time, so it is optimized less, which saves a third of
# its compile time.
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
  # The folder's name on the include path, which starts at compiler/ or, for top-level folders, beside it.
  set(include ${PROJECT_SOURCE_DIR}/compiler)
  cmake_path(IS_PREFIX include ${CMAKE_CURRENT_SOURCE_DIR} is_in_compiler)
  if(NOT is_in_compiler)
    set(include ${PROJECT_SOURCE_DIR})
  endif()
  file(RELATIVE_PATH folder ${include} ${CMAKE_CURRENT_SOURCE_DIR})
  if(arg_SOURCES OR arg_ALONE)
    set(units ${arg_SOURCES})
    if(RETROGRADE_QUICK_BUILD AND arg_SOURCES)
      retrograde_units(units ${folder}/ ${arg_SOURCES})
    endif()
    add_library(${target} STATIC ${units} ${arg_ALONE})
    target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${include}>)
    target_link_libraries(${target} PUBLIC ${arg_DEPENDS} PRIVATE ${arg_PRIVATE_DEPENDS})
    if(RETROGRADE_QUICK_BUILD)
      # The compiler treats files that a unit includes as headers.
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
    retrograde_install_headers(${folder})
  endif()
endfunction()

# retrograde_units(<result> <prefix> <file>...): makes units that include the files. Each is named after the prefix and
# its files are in a folder of the include path.
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
