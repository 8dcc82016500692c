# retrograde_portable: the library for Python wheels. It contains LLVM with hidden symbols, so that it can coexist with
# any other LLVM in the process. Libraries that Debian does not offer as static libraries are placed beside it. If a
# static library is missing, this target is not made: wheels then contain the ordinary shared library and need Debian's
# packages.
execute_process(COMMAND ${RETROGRADE_LLVM_CONFIG} --link-static --libfiles
    x86 aarch64 nvptx orcjit passes bitwriter irreader linker
  OUTPUT_VARIABLE llvm_archives OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE no_archives)
separate_arguments(llvm_archives)
foreach(name z zstd)
  find_library(RETROGRADE_STATIC_${name} NAMES lib${name}.a)
  list(APPEND other_archives ${RETROGRADE_STATIC_${name}})
endforeach()
if(no_archives OR RETROGRADE_SANITIZER OR "${other_archives}" MATCHES "NOTFOUND")
  return()
endif()

find_library(RETROGRADE_GMP_LIBRARY gmp REQUIRED)
add_library(retrograde_portable SHARED EXCLUDE_FROM_ALL)
get_property(layers GLOBAL PROPERTY RETROGRADE_LAYERS)
foreach(layer IN LISTS layers)
  target_sources(retrograde_portable PRIVATE $<TARGET_OBJECTS:${layer}>)
endforeach()
target_link_libraries(retrograde_portable PRIVATE
  -Wl,--start-group ${llvm_archives} -Wl,--end-group ${other_archives}
  retrograde_dep_tbb retrograde_dep_sleef retrograde_dep_isl ${CMAKE_DL_LIBS} m
  # Linked unconditionally: isl finds it because this library has already opened it.
  -Wl,--no-as-needed ${RETROGRADE_GMP_LIBRARY} -Wl,--as-needed)
target_link_options(retrograde_portable PRIVATE
  -Wl,-Bsymbolic-functions -Wl,--no-undefined -Wl,--exclude-libs,ALL -Wl,--gc-sections -Wl,--as-needed)
set_target_properties(retrograde_portable PROPERTIES LINKER_LANGUAGE CXX OUTPUT_NAME retrograde
  LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/portable INSTALL_RPATH "$ORIGIN"
  VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR})

# Files are copied under the names that the linker recorded: libtbb.so.12 for libtbb.so.12.8.
find_library(RETROGRADE_TBB_LIBRARY tbb REQUIRED)
foreach(library ${RETROGRADE_TBB_LIBRARY} ${RETROGRADE_SLEEF_LIBRARY} ${RETROGRADE_ISL_LIBRARY}
    ${RETROGRADE_GMP_LIBRARY})
  get_filename_component(file ${library} REALPATH)
  string(REGEX MATCH "[^/]+\\.so\\.[0-9]+" name ${file})
  install(FILES ${file} DESTINATION retrograde RENAME ${name} COMPONENT python EXCLUDE_FROM_ALL)
endforeach()
