# libretrograde.so: all layers in one shared library, and its installation (CMake package, pkg-config file, umbrella
# header, Halide.h of the compatibility folder).
get_property(layers GLOBAL PROPERTY RETROGRADE_LAYERS)
get_property(outside GLOBAL PROPERTY RETROGRADE_OUTSIDE)
add_library(retrograde SHARED)
add_library(retrograde::retrograde ALIAS retrograde)
# Objects rather than archives, because some layers are only reached by a registration or a test.
foreach(layer IN LISTS layers)
  target_sources(retrograde PRIVATE $<TARGET_OBJECTS:${layer}>)
endforeach()
list(REMOVE_DUPLICATES outside)
target_link_libraries(retrograde PRIVATE ${outside})
set_target_properties(retrograde PROPERTIES LINKER_LANGUAGE CXX)
target_link_options(retrograde PRIVATE -Wl,-Bsymbolic-functions)
if(NOT RETROGRADE_SANITIZER)
  target_link_options(retrograde PRIVATE -Wl,--no-undefined)
endif()
target_include_directories(retrograde INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/compiler/frontend/include>
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/compiler>
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/retrograde>)
target_compile_options(retrograde INTERFACE
  "SHELL:-idirafter ${RETROGRADE_HALIDE_RUNTIME_INCLUDE}")
target_compile_features(retrograde INTERFACE cxx_std_20)
target_link_libraries(retrograde INTERFACE Threads::Threads ${CMAKE_DL_LIBS})
set_target_properties(retrograde PROPERTIES
  VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR})

# retrograde::halide_compat: the same library, with an include path on which `#include "Halide.h"` finds ours.
add_library(retrograde_halide_compat INTERFACE)
set_target_properties(retrograde_halide_compat PROPERTIES EXPORT_NAME halide_compat)
add_library(retrograde::halide_compat ALIAS retrograde_halide_compat)
target_include_directories(retrograde_halide_compat BEFORE INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/compiler/frontend/compat>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/retrograde-halide>)
target_link_libraries(retrograde_halide_compat INTERFACE retrograde)

include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/retrograde)
install(TARGETS retrograde retrograde_halide_compat retrograde_static_runtime retrograde_simt
  retrograde_run_gen_main
  EXPORT retrogradeTargets)
install(EXPORT retrogradeTargets NAMESPACE retrograde:: DESTINATION ${package_dir})
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/retrogradeConfig.cmake.in
  ${CMAKE_BINARY_DIR}/retrogradeConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/retrogradeConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/retrogradeConfig.cmake
  ${CMAKE_BINARY_DIR}/retrogradeConfigVersion.cmake DESTINATION ${package_dir})
# For find_package(Retrograde).
install(FILES ${CMAKE_BINARY_DIR}/retrogradeConfig.cmake DESTINATION ${package_dir}
  RENAME retrograde-config.cmake)
install(FILES ${CMAKE_BINARY_DIR}/retrogradeConfigVersion.cmake DESTINATION ${package_dir}
  RENAME retrograde-config-version.cmake)

install(FILES ${PROJECT_SOURCE_DIR}/cmake/RetrogradeGenerators.cmake
  ${PROJECT_SOURCE_DIR}/cmake/RetrogradeTorch.cmake DESTINATION ${package_dir})

# find_package(Halide) for projects written for Halide 14 to 21.
set(halide_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Halide)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/halide/HalideConfig.cmake.in
  ${CMAKE_BINARY_DIR}/HalideConfig.cmake INSTALL_DESTINATION ${halide_package_dir})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/HalideConfigVersion.cmake
  VERSION 21.0.0 COMPATIBILITY AnyNewerVersion)
install(FILES ${CMAKE_BINARY_DIR}/HalideConfig.cmake ${CMAKE_BINARY_DIR}/HalideConfigVersion.cmake
  DESTINATION ${halide_package_dir})

# The same under its package's other name, for builds that only call generators.
set(helpers_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/HalideHelpers)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/halide/HalideConfig.cmake.in
  ${CMAKE_BINARY_DIR}/HalideHelpersConfig.cmake INSTALL_DESTINATION ${helpers_package_dir})
install(FILES ${CMAKE_BINARY_DIR}/HalideHelpersConfig.cmake DESTINATION ${helpers_package_dir})
install(FILES ${CMAKE_BINARY_DIR}/HalideConfigVersion.cmake DESTINATION ${helpers_package_dir}
  RENAME HalideHelpersConfigVersion.cmake)

foreach(package IN ITEMS generator run-gen)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/retrograde-${package}.pc.in
    ${CMAKE_BINARY_DIR}/retrograde-${package}.pc @ONLY)
  install(FILES ${CMAKE_BINARY_DIR}/retrograde-${package}.pc
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endforeach()
configure_file(${PROJECT_SOURCE_DIR}/cmake/retrograde.pc.in ${CMAKE_BINARY_DIR}/retrograde.pc @ONLY)
configure_file(${PROJECT_SOURCE_DIR}/cmake/retrograde-halide.pc.in
  ${CMAKE_BINARY_DIR}/retrograde-halide.pc @ONLY)
configure_file(${PROJECT_SOURCE_DIR}/cmake/retrograde-runtime.pc.in
  ${CMAKE_BINARY_DIR}/retrograde-runtime.pc @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/retrograde.pc ${CMAKE_BINARY_DIR}/retrograde-halide.pc
  ${CMAKE_BINARY_DIR}/retrograde-runtime.pc
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/compiler/frontend/include/
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
install(DIRECTORY ${PROJECT_SOURCE_DIR}/compiler/frontend/compat/
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/retrograde-halide FILES_MATCHING PATTERN "*.h")
