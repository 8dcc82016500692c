# retrograde_portable: the library as wheels carry it. LLVM is inside, its symbols hidden, so that it lives beside any
# other LLVM of the process; what Debian has no static libraries of that go into a shared one lies beside it.
# Not made where a static library is missing: then wheels hold the shared library, and want Debian's packages.
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
  # Not as needed: isl finds it because this library has opened it before.
  -Wl,--no-as-needed ${RETROGRADE_GMP_LIBRARY} -Wl,--as-needed)
target_link_options(retrograde_portable PRIVATE
  -Wl,-Bsymbolic-functions -Wl,--no-undefined -Wl,--exclude-libs,ALL -Wl,--gc-sections -Wl,--as-needed)
set_target_properties(retrograde_portable PROPERTIES LINKER_LANGUAGE CXX OUTPUT_NAME retrograde
  LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/portable INSTALL_RPATH "$ORIGIN"
  VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR})

# Under the names that it is linked with: libtbb.so.12 of libtbb.so.12.8.
find_library(RETROGRADE_TBB_LIBRARY tbb REQUIRED)
foreach(library ${RETROGRADE_TBB_LIBRARY} ${RETROGRADE_SLEEF_LIBRARY} ${RETROGRADE_ISL_LIBRARY}
    ${RETROGRADE_GMP_LIBRARY})
  get_filename_component(file ${library} REALPATH)
  string(REGEX MATCH "[^/]+\\.so\\.[0-9]+" name ${file})
  install(FILES ${file} DESTINATION retrograde RENAME ${name} COMPONENT python EXCLUDE_FROM_ALL)
endforeach()
