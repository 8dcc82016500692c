# The language: handles, operators and directives.
retrograde_test(
  constant_functions_test
  error_codes_test
  literal_zero_test
  public_names_test
  schedule_directives_test
  value_conversions_test
  TOGETHER frontend_tests LIBS retrograde_dep_halide_runtime)
retrograde_test(error_message_test LAYERS diagnostics)
retrograde_test(frontend_calls_test frontend_language_test LAYERS frontend LIBS retrograde_dep_halide_runtime)
retrograde_test(operators_test LAYERS ir)
