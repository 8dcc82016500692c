# Programs and services in Halide's names.
retrograde_test(halide_compat_test EXPORTS RUNTIME
  SOURCES unit/halide/halide_compat_test.cpp unit/halide/halide_names_test.cpp unit/halide/halide_features_test.cpp
          unit/halide/halide_internal_test.cpp
  LIBS retrograde_halide_compat)
retrograde_test(halide_services_test EXPORTS RUNTIME LAYERS static_runtime)
