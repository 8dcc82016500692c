# Error messages.
retrograde_test(
  aot_errors_test
  compute_with_errors_test
  extern_errors_test
  generator_errors_test
  gpu_rules_test
  schedule_errors_test
  TOGETHER error_tests)
retrograde_test(
  refused_programs_test
  requirements_of_parts_test
  rules_of_tools_test
  rules_test
  stated_requirements_test
  TOGETHER refusal_tests LIBS retrograde_dep_halide_runtime)
retrograde_test(frontend_errors_test LAYERS frontend LIBS retrograde_dep_halide_runtime)
