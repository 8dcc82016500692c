# Derivatives.
retrograde_test(
  constant_places_test
  custom_adjoint_test
  deep_programs_test
  explain_test
  extreme_operands_test
  factored_program_test
  gradient_error_test
  gradient_lookup_test
  hessian_test
  invariance_test
  jacobian_test
  long_sums_test
  nesting_test
  odd_sizes_test
  operation_count_test
  passed_reads_test
  phases_test
  residuals_test
  second_derivatives_test
  several_outputs_test
  shared_adjoints_test
  stability_strong_zeros_test
  stable_forms_test
  straight_through_test
  tangents_test
  time_axis_test
  unbounded_reads_test
  value_range_test
  version_budget_test
  zero_borders_test
  TOGETHER gradient_tests LIBS retrograde_dep_halide_runtime)
retrograde_test(coarse_grids_test)
retrograde_test(access_inversion_test LAYERS autodiff OPTIMIZED)
retrograde_test(access_table_test
  SOURCES gradient/access_table_test.cpp gradient/access_table/halide_side.cpp
          gradient/access_table/retrograde_side.cpp
  LIBS retrograde_dep_halide)
retrograde_test(check_gradients_test check_stability_test
  LIBS retrograde_dep_halide_runtime retrograde_dep_json)
retrograde_test(checkpoint_test custom_extern_test EXPORTS RUNTIME LIBS retrograde_dep_halide_runtime)
retrograde_test(colouring_test derivative_rules_test LAYERS autodiff LIBS retrograde_dep_halide_runtime)
retrograde_test(plot_report_test READS_FILES LIBS retrograde_dep_halide_runtime)
retrograde_test(stable_forms_random_test LIBS gradient_forms)
retrograde_test(update_random_test LIBS gradient_adversary)

# Programs that several tests differentiate.
set(suite_programs
  gradient/programs_accesses.cpp
  gradient/programs_pathologies.cpp
  gradient/programs_pointwise.cpp
  gradient/update_programs.cpp
  gradient/update_reductions.cpp
  gradient/update_filters.cpp
  gradient/update_scans.cpp
  gradient/update_steps.cpp)
retrograde_test(gpu_gradients_test SOURCES gradient/gpu_gradients_test.cpp ${suite_programs}
  LIBS retrograde_dep_halide_runtime)
retrograde_test(gradient_cost_test READS_FILES
  SOURCES gradient/cost_test.cpp gradient/programs_large.cpp ${suite_programs}
  LIBS retrograde_dep_halide_runtime)
retrograde_test(gradient_programs_test SOURCES gradient/programs_test.cpp LIBS retrograde_dep_halide_runtime)
retrograde_test(gradient_suite_test SOURCES gradient/programs_suite_test.cpp ${suite_programs}
  LIBS retrograde_dep_halide_runtime SHARDS 8)
retrograde_test(gradient_threads_test SOURCES gradient/threads_test.cpp gradient/programs_large.cpp
  LIBS retrograde_dep_halide_runtime)
