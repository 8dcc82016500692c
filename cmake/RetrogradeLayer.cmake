# retrograde_layer(<name> [INTERNAL] SOURCES <file>... DEPENDS <layer>... [PRIVATE_DEPENDS <dep>...])
#
# Makes the target retrograde_<name> of one folder. DEPENDS names the layers below it, without the
# prefix; PRIVATE_DEPENDS names outside libraries that no header of the folder shows. Headers are
# installed under include/retrograde/<folder> unless the layer is INTERNAL. A folder without sources
# yet is an INTERFACE library.
define_property(GLOBAL PROPERTY RETROGRADE_LAYERS BRIEF_DOCS "All layers that have sources")
define_property(GLOBAL PROPERTY RETROGRADE_OUTSIDE BRIEF_DOCS "Outside libraries that they use")

function(retrograde_layer name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "INTERNAL" "" "SOURCES;DEPENDS;PRIVATE_DEPENDS")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "retrograde_layer(${name}): unknown arguments ${arg_UNPARSED_ARGUMENTS}")
  endif()
  set(target retrograde_${name})
  list(TRANSFORM arg_DEPENDS PREPEND retrograde_)
  set(include ${PROJECT_SOURCE_DIR}/compiler)
  if(arg_SOURCES)
    add_library(${target} STATIC ${arg_SOURCES})
    target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${include}>)
    target_link_libraries(${target} PUBLIC ${arg_DEPENDS} PRIVATE ${arg_PRIVATE_DEPENDS})
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

function(retrograde_install_headers folder)
  install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/retrograde/${folder}
    FILES_MATCHING PATTERN "*.h" PATTERN "*.def" PATTERN "include" EXCLUDE PATTERN "compat" EXCLUDE)
endfunction()
