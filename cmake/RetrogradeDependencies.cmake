# Dependencies as targets. Their Debian packages are in tools/packages.list.
#   retrograde_dep_llvm            LLVM 19, shared; only compiler/codegen, compiler/jit and compiler/aot may use it
#   retrograde_dep_isl             integer relations
#   retrograde_dep_tbb             parallel loops
#   retrograde_dep_sleef           vector math
#   retrograde_dep_halide_runtime  HalideRuntime.h and HalideBuffer.h, headers only
#   retrograde_dep_halide          the Halide 14 compiler, for tests and benchmarks only
#   retrograde_dep_image           OpenImageIO, for apps
#   retrograde_dep_sqlite          for tools/tune
#   retrograde_dep_ceres           L-BFGS and conjugate gradients, for apps
#   retrograde_dep_opencv          features and homographies of images, for apps
#   retrograde_dep_cli, retrograde_dep_json   command lines and reports, for apps
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)

# LLVM is found by its llvm-config program: its CMake package requires development packages (terminfo, zstd, libxml2
# ...) that the shared library does not need.
find_program(RETROGRADE_LLVM_CONFIG NAMES llvm-config-19 PATHS /usr/lib/llvm-19/bin REQUIRED)
execute_process(COMMAND ${RETROGRADE_LLVM_CONFIG} --includedir
  OUTPUT_VARIABLE llvm_include OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${RETROGRADE_LLVM_CONFIG} --libdir
  OUTPUT_VARIABLE llvm_libdir OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${RETROGRADE_LLVM_CONFIG} --version
  OUTPUT_VARIABLE llvm_version OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
# 191 for 19.1.7
string(REGEX REPLACE "^([0-9]+)\\.([0-9]+).*" "\\1\\2" RETROGRADE_LLVM_VERSION ${llvm_version})
find_library(RETROGRADE_LLVM_LIBRARY NAMES LLVM-19 PATHS ${llvm_libdir} NO_DEFAULT_PATH REQUIRED)
add_library(retrograde_dep_llvm INTERFACE)
target_include_directories(retrograde_dep_llvm SYSTEM INTERFACE ${llvm_include})
target_compile_definitions(retrograde_dep_llvm INTERFACE
  _GNU_SOURCE __STDC_CONSTANT_MACROS __STDC_FORMAT_MACROS __STDC_LIMIT_MACROS)
target_link_libraries(retrograde_dep_llvm INTERFACE ${RETROGRADE_LLVM_LIBRARY})

find_path(RETROGRADE_ISL_INCLUDE isl/map.h REQUIRED)
find_library(RETROGRADE_ISL_LIBRARY isl REQUIRED)
add_library(retrograde_dep_isl INTERFACE)
target_include_directories(retrograde_dep_isl SYSTEM INTERFACE ${RETROGRADE_ISL_INCLUDE})
target_link_libraries(retrograde_dep_isl INTERFACE ${RETROGRADE_ISL_LIBRARY})

find_package(TBB REQUIRED)
add_library(retrograde_dep_tbb INTERFACE)
target_link_libraries(retrograde_dep_tbb INTERFACE TBB::tbb Threads::Threads)

find_library(RETROGRADE_SLEEF_LIBRARY sleef REQUIRED)
add_library(retrograde_dep_sleef INTERFACE)
target_link_libraries(retrograde_dep_sleef INTERFACE ${RETROGRADE_SLEEF_LIBRARY})

# -idirafter: the folder also contains Halide's Halide.h, which must never hide ours.
find_path(RETROGRADE_HALIDE_RUNTIME_INCLUDE HalideRuntime.h PATH_SUFFIXES halide14 REQUIRED)
add_library(retrograde_dep_halide_runtime INTERFACE)
target_compile_options(retrograde_dep_halide_runtime INTERFACE
  "SHELL:-idirafter ${RETROGRADE_HALIDE_RUNTIME_INCLUDE}")
target_link_libraries(retrograde_dep_halide_runtime INTERFACE ${CMAKE_DL_LIBS})

find_path(RETROGRADE_JSON_INCLUDE nlohmann/json.hpp REQUIRED)
add_library(retrograde_dep_json INTERFACE)
target_include_directories(retrograde_dep_json SYSTEM INTERFACE ${RETROGRADE_JSON_INCLUDE})

find_package(Boost REQUIRED COMPONENTS context)  # Boost::context: fibers of the simulated device

# The rest is for applications, tools, tests and benchmarks.
if(NOT RETROGRADE_PROGRAMS)
  return()
endif()
find_package(JPEG REQUIRED)  # JPEG::JPEG: detects truncated pictures
pkg_check_modules(OIIO REQUIRED IMPORTED_TARGET OpenImageIO)
add_library(retrograde_dep_image INTERFACE)
target_link_libraries(retrograde_dep_image INTERFACE PkgConfig::OIIO)

# Found by hand: Ceres' CMake package requires the development packages of all its dependencies. The gradient solver's
# headers need only those of glog and Eigen.
find_path(RETROGRADE_CERES_INCLUDE ceres/gradient_problem_solver.h REQUIRED)
find_path(RETROGRADE_EIGEN_INCLUDE Eigen/Core PATH_SUFFIXES eigen3 REQUIRED)
find_library(RETROGRADE_CERES_LIBRARY ceres REQUIRED)
find_library(RETROGRADE_GLOG_LIBRARY glog REQUIRED)
add_library(retrograde_dep_ceres INTERFACE)
target_include_directories(retrograde_dep_ceres SYSTEM INTERFACE ${RETROGRADE_CERES_INCLUDE}
  ${RETROGRADE_EIGEN_INCLUDE})
target_link_libraries(retrograde_dep_ceres INTERFACE ${RETROGRADE_CERES_LIBRARY}
  ${RETROGRADE_GLOG_LIBRARY})

find_path(RETROGRADE_CLI_INCLUDE CLI/CLI.hpp REQUIRED)
add_library(retrograde_dep_cli INTERFACE)
target_include_directories(retrograde_dep_cli SYSTEM INTERFACE ${RETROGRADE_CLI_INCLUDE})

# Found by hand: OpenCV's CMake package comes only with the development packages of all of OpenCV.
if(RETROGRADE_BUILD_APPS STREQUAL "all" OR "burst_superresolution" IN_LIST RETROGRADE_BUILD_APPS)
  find_path(RETROGRADE_OPENCV_INCLUDE opencv2/calib3d.hpp PATH_SUFFIXES opencv4 REQUIRED)
  add_library(retrograde_dep_opencv INTERFACE)
  target_include_directories(retrograde_dep_opencv SYSTEM INTERFACE ${RETROGRADE_OPENCV_INCLUDE})
  foreach(module calib3d features2d core)
    find_library(RETROGRADE_OPENCV_${module} opencv_${module} REQUIRED)
    target_link_libraries(retrograde_dep_opencv INTERFACE ${RETROGRADE_OPENCV_${module}})
  endforeach()
endif()

# The rest is for tools, tests and benchmarks, which are only built with all apps.
if(NOT RETROGRADE_BUILD_APPS STREQUAL "all")
  return()
endif()
find_library(RETROGRADE_HALIDE_LIBRARY NAMES Halide14 REQUIRED)
get_filename_component(retrograde_halide_folder ${RETROGRADE_HALIDE_LIBRARY} DIRECTORY)
find_library(RETROGRADE_HALIDE_LI2018 NAMES autoschedule_li2018
  PATHS ${retrograde_halide_folder}/halide14 ${retrograde_halide_folder} NO_DEFAULT_PATH REQUIRED)
add_library(retrograde_dep_halide INTERFACE)
target_include_directories(retrograde_dep_halide SYSTEM INTERFACE
  ${RETROGRADE_HALIDE_RUNTIME_INCLUDE})
target_link_libraries(retrograde_dep_halide INTERFACE ${RETROGRADE_HALIDE_LIBRARY} ${CMAKE_DL_LIBS})

find_path(RETROGRADE_SQLITE_INCLUDE sqlite3.h REQUIRED)
find_library(RETROGRADE_SQLITE_LIBRARY sqlite3 REQUIRED)
add_library(retrograde_dep_sqlite INTERFACE)
target_include_directories(retrograde_dep_sqlite SYSTEM INTERFACE ${RETROGRADE_SQLITE_INCLUDE})
target_link_libraries(retrograde_dep_sqlite INTERFACE ${RETROGRADE_SQLITE_LIBRARY})
