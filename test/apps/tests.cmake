# The applications: their parts as libraries, and their programs by running them.

# runs_app(<app> <definition> TESTS <test>... [DEFINITIONS <definition>...]): the tests run the app's program, whose
# path is the first definition.
function(runs_app app definition)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "TESTS;DEFINITIONS")
  foreach(test ${arg_TESTS})
    add_dependencies(${test} ${app})
    target_compile_definitions(${test} PRIVATE ${definition}="$<TARGET_FILE:${app}>" ${arg_DEFINITIONS})
  endforeach()
endfunction()

retrograde_test(app_bilateral_slice_test SOURCES apps/bilateral_slice/program_test.cpp
  LIBS retrograde_apps_common retrograde_dep_json CACHED)
retrograde_test(app_bilateral_slice_errors_test SOURCES apps/bilateral_slice/errors_test.cpp
  LIBS retrograde_apps_common CACHED)
runs_app(bilateral_slice BILATERAL_SLICE_PROGRAM TESTS app_bilateral_slice_test app_bilateral_slice_errors_test)
# The program runs beside its peer.
add_dependencies(app_bilateral_slice_test bilateral_slice_halide_peer)
add_dependencies(app_bilateral_slice_errors_test bilateral_slice_halide_peer)

foreach(part errors model program)
  set(test app_burst_superresolution_${part}_test)
  retrograde_test(${test} SOURCES apps/burst_superresolution/${part}_test.cpp LIBS burst_parts CACHED)
  runs_app(burst_superresolution BURST_PROGRAM TESTS ${test})
endforeach()

retrograde_test(app_common_test SOURCES apps/common/common_test.cpp
  LIBS retrograde_apps_common retrograde_dep_cli)
retrograde_test(app_images_test SOURCES apps/common/images_test.cpp apps/common/division_test.cpp
  LIBS retrograde_apps_common retrograde_dep_image)
retrograde_test(app_learning_run_test SOURCES apps/common/learning_run_test.cpp LIBS retrograde_apps_common)
retrograde_test(app_minimize_test SOURCES apps/common/minimize_test.cpp LIBS retrograde_apps_common CACHED)

foreach(part errors model program)
  set(test app_deconvolution_${part}_test)
  retrograde_test(${test} SOURCES apps/deconvolution/${part}_test.cpp LIBS deconvolution_parts CACHED)
  runs_app(deconvolution DECONVOLUTION_PROGRAM TESTS ${test}
    DEFINITIONS DECONVOLUTION_WEIGHTS="${PROJECT_SOURCE_DIR}/apps/deconvolution/weights")
endforeach()

retrograde_test(app_demosaic_test SOURCES apps/demosaic/program_test.cpp LIBS demosaic_parts CACHED)
retrograde_test(app_demosaic_errors_test SOURCES apps/demosaic/errors_test.cpp LIBS retrograde_apps_common CACHED)
runs_app(demosaic DEMOSAIC_PROGRAM TESTS app_demosaic_test app_demosaic_errors_test
  DEFINITIONS DEMOSAIC_WEIGHTS="${PROJECT_SOURCE_DIR}/apps/demosaic/weights")

retrograde_test(app_fluid_test SOURCES apps/fluid/program_test.cpp
  LIBS retrograde_apps_common retrograde_dep_json CACHED)
retrograde_test(app_fluid_errors_test SOURCES apps/fluid/errors_test.cpp LIBS retrograde_apps_common CACHED)
retrograde_test(app_fluid_model_test SOURCES apps/fluid/model_test.cpp LIBS fluid_model retrograde_dep_image CACHED)
runs_app(fluid FLUID_PROGRAM TESTS app_fluid_test app_fluid_errors_test)

retrograde_test(app_lens_test SOURCES apps/lens/program_test.cpp LIBS lens_model CACHED)
retrograde_test(app_lens_errors_test SOURCES apps/lens/errors_test.cpp LIBS retrograde_apps_common CACHED)
runs_app(lens LENS_PROGRAM TESTS app_lens_test app_lens_errors_test
  DEFINITIONS LENS_PRESCRIPTIONS="${PROJECT_SOURCE_DIR}/apps/lens/prescriptions")
