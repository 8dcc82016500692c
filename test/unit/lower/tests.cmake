# Lowering: directives and passes.
retrograde_test(
  compute_with_test
  hoist_storage_test
  loop_nest_test
  loop_schedules_test
  lower_names_test
  resolve_undef_test
  specialize_test
  value_bounds_test
  TOGETHER lower_loops_tests)
retrograde_test(pass_observer_test)
retrograde_test(fold_steps_test LIBS retrograde_dep_halide_runtime)
retrograde_test(
  debug_file_test
  empty_images_test
  float_index_test
  folded_domains_test
  legal_programs_test
  likely_clamps_test
  prefetch_test
  ring_buffer_test
  several_points_test
  sliding_window_test
  tracing_test
  TOGETHER lower_programs_tests LIBS retrograde_dep_halide_runtime)
retrograde_test(
  async_test
  atomic_test
  extern_stage_test
  memoize_test
  skip_stages_test
  TOGETHER lower_callback_tests EXPORTS RUNTIME LIBS retrograde_dep_halide_runtime)
retrograde_test(profiler_test ALONE EXPORTS RUNTIME LIBS retrograde_dep_halide_runtime)
retrograde_test(fork_test LAYERS runtime)

add_dependencies(pass_observer_test retrograde_opt)
target_compile_definitions(pass_observer_test PRIVATE
  RETROGRADE_OPT="$<TARGET_FILE:retrograde_opt>"
  RETROGRADE_THIS_PROGRAM="$<TARGET_FILE:pass_observer_test>")
