# CMake functions for generators, for this project and for projects that use the installed package.
#
#   add_retrograde_generator(<target> SOURCES <file>... [LINK_LIBRARIES <target>...])
#     Builds the program of the generators in these files; retrograde::generator provides its main().
#
#   add_retrograde_library(<target> FROM <generator-target> [GENERATOR <name>] [FUNCTION_NAME <name>]
#     [NAMESPACE <ns>] [GRADIENT | SEPARATE_GRADIENTS] [PARAMS <param=value>...] [TARGETS <target>...]
#     [FEATURES <feature>...] [USE_RUNTIME <target>] [AUTOSCHEDULER <name>] [PLUGINS <target>...]
#     [SIMULATED_GPU] [HEADER <var>] [ASSEMBLY <var>] [BITCODE <var>] [LLVM_ASSEMBLY <var>] [STMT <var>]
#     [STMT_HTML <var>] [REGISTRATION <var>] [FUNCTION_INFO_HEADER <var>])
#     Makes a library with the generator's function, and <target>.h on its include path.
#     GENERATOR and FUNCTION_NAME default to <target>; TARGETS to host, or to the variable Retrograde_TARGET.
#     With several TARGETS, the function selects one at run time; the last one must run on every machine.
#     SIMULATED_GPU: kernels (FEATURES cuda) also run on the simulated device, which RETROGRADE_GPU=simulated
#     selects at run time. GRADIENT: the function computes the gradient. SEPARATE_GRADIENTS: one function
#     computes the gradients with respect to all images and numbers, and there is one for each of them
#     (generator/gradient_module.cpp). The <var> arguments receive the names of extra files beside the header.
#
#   add_retrograde_runtime(<target> [FROM <generator-target>] [TARGETS <target>...])
#     A runtime for USE_RUNTIME: retrograde::runtime or, for another platform, one that the generator's
#     program writes. Every library <lib> also has one, named <lib>.runtime.
#
# To run a library's function from the command line, link its registration file (the file that REGISTRATION names) with
# the library and retrograde::run_gen.
#
# The library needs a runtime: the small static retrograde::runtime, unless USE_RUNTIME names another. A process that
# uses such a library does not contain the compiler.

function(add_retrograde_generator target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "PYSTUB" "PACKAGE_NAME;PACKAGE_NAMESPACE;EXPORT_FILE"
    "SOURCES;LINK_LIBRARIES")
  if(arg_PYSTUB)
    message(FATAL_ERROR "add_retrograde_generator(${target}): PYSTUB asks for a Python module of the "
      "generator, which is not made. Leave it out.")
  endif()
  if(arg_PACKAGE_NAME OR arg_EXPORT_FILE)
    message(STATUS "add_retrograde_generator(${target}): no package of the generator is written; "
      "it is built where it is used")
  endif()
  if(NOT arg_SOURCES)
    set(arg_SOURCES ${arg_UNPARSED_ARGUMENTS})
  endif()
  add_executable(${target} ${arg_SOURCES})
  target_link_libraries(${target} PRIVATE ${arg_LINK_LIBRARIES} retrograde::generator)
endfunction()

# Sets <out> to TRUE if the target string names this build's platform.
function(_retrograde_is_native out target)
  set(processor x86)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
    set(processor arm)
  endif()
  if(target MATCHES "^(host|cmake)" OR target MATCHES "^${processor}-64-linux")
    set(${out} TRUE PARENT_SCOPE)
  else()
    set(${out} FALSE PARENT_SCOPE)
  endif()
endfunction()

# A runtime for another platform, written by the generator's program.
function(_retrograde_foreign_runtime name generator target)
  set(file ${CMAKE_CURRENT_BINARY_DIR}/${name}.a)
  add_custom_command(OUTPUT ${file}
    COMMAND ${generator} -r ${name} -o ${CMAKE_CURRENT_BINARY_DIR} -e static_library target=${target}
    DEPENDS ${generator} VERBATIM)
  add_custom_target(${name}.update DEPENDS ${file})
  add_library(${name} STATIC IMPORTED GLOBAL)
  set_target_properties(${name} PROPERTIES IMPORTED_LOCATION ${file})
  add_dependencies(${name} ${name}.update)
  target_link_libraries(${name} INTERFACE Threads::Threads ${CMAKE_DL_LIBS})
endfunction()

function(add_retrograde_runtime target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "FROM" "TARGETS")
  list(APPEND arg_TARGETS host)
  list(GET arg_TARGETS 0 first_target)
  _retrograde_is_native(native ${first_target})
  if(native)
    add_library(${target} INTERFACE)
    target_link_libraries(${target} INTERFACE retrograde::runtime)
  elseif(arg_FROM)
    _retrograde_foreign_runtime(${target} ${arg_FROM} ${first_target})
  else()
    message(FATAL_ERROR "add_retrograde_runtime(${target}): a runtime for ${first_target} is written "
      "by a generator's program. Name one with FROM.")
  endif()
endfunction()

function(add_retrograde_library target)
  set(extra_types ASSEMBLY BITCODE COMPILER_LOG FEATURIZATION FUNCTION_INFO_HEADER LLVM_ASSEMBLY
    PYTHON_EXTENSION PYTORCH_WRAPPER REGISTRATION SCHEDULE STMT STMT_HTML)
  set(ASSEMBLY_extension .s)
  set(BITCODE_extension .bc)
  set(COMPILER_LOG_extension .halide_compiler_log)
  set(FEATURIZATION_extension .featurization)
  set(FUNCTION_INFO_HEADER_extension .function_info.h)
  set(LLVM_ASSEMBLY_extension .ll)
  set(PYTHON_EXTENSION_extension .py.cpp)
  set(PYTORCH_WRAPPER_extension .pytorch.h)
  set(REGISTRATION_extension .registration.cpp)
  set(SCHEDULE_extension .schedule.h)
  set(STMT_extension .stmt)
  set(STMT_HTML_extension .stmt.html)
  cmake_parse_arguments(PARSE_ARGV 1 arg "GRADIENT;GRADIENT_DESCENT;SEPARATE_GRADIENTS;C_BACKEND;SIMULATED_GPU"
    "FROM;GENERATOR;FUNCTION_NAME;NAMESPACE;USE_RUNTIME;AUTOSCHEDULER;HEADER;${extra_types}"
    "TARGETS;FEATURES;PARAMS;PLUGINS")
  set(asked "add_retrograde_library(${target})")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "${asked}: unknown arguments ${arg_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT arg_FROM OR NOT TARGET ${arg_FROM})
    message(FATAL_ERROR "${asked}: FROM names the target of a generator's program, "
      "\"${arg_FROM}\" is none. Make one with add_retrograde_generator.")
  endif()
  if(arg_C_BACKEND)
    message(FATAL_ERROR "${asked}: C_BACKEND asks for C source, which is not generated. Leave it out.")
  endif()

  # ---- the generator's arguments ----
  foreach(name GENERATOR FUNCTION_NAME)
    if(NOT arg_${name})
      set(arg_${name} ${target})
    endif()
  endforeach()
  if(arg_NAMESPACE)
    string(PREPEND arg_FUNCTION_NAME "${arg_NAMESPACE}::")
    list(APPEND arg_FEATURES c_plus_plus_name_mangling)
  endif()
  if(NOT arg_TARGETS)
    set(arg_TARGETS ${Retrograde_TARGET})
  endif()
  if(NOT arg_TARGETS)
    set(arg_TARGETS host)
  endif()
  list(TRANSFORM arg_TARGETS REPLACE "^cmake" "host")
  list(REMOVE_DUPLICATES arg_FEATURES)
  list(APPEND arg_FEATURES no_runtime)
  list(JOIN arg_FEATURES "-" features)
  list(GET arg_TARGETS 0 first_target)
  list(TRANSFORM arg_TARGETS APPEND "-${features}")
  list(JOIN arg_TARGETS "," targets)
  set(gradient 0)
  if(arg_GRADIENT OR arg_GRADIENT_DESCENT)
    set(gradient 1)
  endif()
  if(arg_SEPARATE_GRADIENTS)
    set(gradient separate)
  endif()
  set(scheduler)
  if(arg_AUTOSCHEDULER MATCHES "^Halide::" AND NOT TARGET "${arg_AUTOSCHEDULER}")
    message(STATUS "${asked}: ${arg_AUTOSCHEDULER} is a scheduler of another compiler; the "
      "generator's own schedule is used")
    set(arg_AUTOSCHEDULER)
    list(FILTER arg_PARAMS EXCLUDE REGEX "^(auto_schedule|autoscheduler)(=|\\.)")
  endif()
  if(arg_AUTOSCHEDULER)
    # A::B names a plugin's target that contains the autoscheduler B.
    if(TARGET "${arg_AUTOSCHEDULER}")
      list(APPEND arg_PLUGINS ${arg_AUTOSCHEDULER})
    endif()
    string(REGEX REPLACE ".*::" "" scheduler_name "${arg_AUTOSCHEDULER}")
    set(scheduler -s ${scheduler_name})
    list(PREPEND arg_PARAMS auto_schedule=true)
  endif()
  set(plugins)
  foreach(plugin IN LISTS arg_PLUGINS)
    list(APPEND plugins $<TARGET_FILE:${plugin}>)
  endforeach()
  if(plugins)
    list(JOIN plugins "," plugins)
    set(plugins -p ${plugins})
  endif()

  # ---- the generator's outputs ----
  # For one target on this platform, the generator writes an object and the library is an ordinary one. For several
  # targets, or another platform, the generator writes the library.
  _retrograde_is_native(native ${first_target})
  list(LENGTH arg_TARGETS target_count)
  set(folder ${CMAKE_CURRENT_BINARY_DIR})
  set(emit c_header)
  set(files ${folder}/${target}.h)
  if(native AND target_count EQUAL 1)
    list(APPEND emit object)
    set(code ${folder}/${target}.o)
  else()
    list(APPEND emit static_library)
    set(code ${folder}/${target}.a)
  endif()
  list(APPEND files ${code})
  if(arg_HEADER)
    set(${arg_HEADER} ${target}.h PARENT_SCOPE)
  endif()
  foreach(type IN LISTS extra_types)
    if(arg_${type})
      string(TOLOWER ${type} type_name)
      list(APPEND emit ${type_name})
      # With several targets there is one such file for each, named by the generator.
      if(target_count EQUAL 1)
        list(APPEND files ${folder}/${target}${${type}_extension})
      endif()
      set(${arg_${type}} ${target}${${type}_extension} PARENT_SCOPE)
    endif()
  endforeach()
  list(JOIN emit "," emit)
  set(program ${arg_FROM})
  if(arg_SIMULATED_GPU)
    set(program ${CMAKE_COMMAND} -E env RETROGRADE_GPU=simulated $<TARGET_FILE:${arg_FROM}>)
  endif()
  add_custom_command(OUTPUT ${files}
    COMMAND ${program} -n ${target} -d ${gradient} -g ${arg_GENERATOR} -f ${arg_FUNCTION_NAME}
            -e ${emit} ${plugins} ${scheduler} -o ${folder} target=${targets} ${arg_PARAMS}
    DEPENDS ${arg_FROM} ${arg_PLUGINS}
    COMMENT "Generating ${target}" VERBATIM)
  add_custom_target(${target}.update ALL DEPENDS ${files})

  # ---- the library ----
  if(native AND target_count EQUAL 1)
    add_library(${target} STATIC ${code})
    set_target_properties(${target} PROPERTIES LINKER_LANGUAGE CXX POSITION_INDEPENDENT_CODE ON)
  else()
    add_library(${target} STATIC IMPORTED GLOBAL)
    set_target_properties(${target} PROPERTIES IMPORTED_LOCATION ${code})
  endif()
  add_dependencies(${target} ${target}.update)
  target_include_directories(${target} INTERFACE $<BUILD_INTERFACE:${folder}>)
  if(NOT arg_USE_RUNTIME)
    set(arg_USE_RUNTIME ${target}.runtime)
    add_retrograde_runtime(${target}.runtime FROM ${arg_FROM} TARGETS ${first_target})
  endif()
  target_link_libraries(${target} INTERFACE ${arg_USE_RUNTIME})
endfunction()
