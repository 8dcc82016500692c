# Directives of the autoscheduler, and the cost model.
retrograde_test(
  atomic_scatters_test
  autoschedule_options_test
  built_in_scheduler_test
  chain_growth_test
  choose_schedule_test
  cost_model_test
  default_schedule_test
  explain_stages_test
  invariant_factors_test
  memory_budget_test
  row_reductions_test
  row_scans_test
  step_loops_test
  strided_terms_test
  turned_sums_test
  blocked_recurrences_test
  wavefronts_test
  machine_test
  TOGETHER autoschedule_tests LIBS retrograde_dep_halide_runtime retrograde_dep_json)
retrograde_test(auto_schedule_test OPTIMIZED)
retrograde_test(coarse_values_test)
retrograde_test(point_loops_test LIBS retrograde_dep_halide_runtime)
retrograde_test(gpu_auto_schedule_test SOURCES autoschedule/gpu_auto_schedule_test.cpp support/gpu_programs.cpp
  LIBS retrograde_simt retrograde_dep_halide_runtime)
retrograde_test(gpu_auto_schedules_test OPTIMIZED LIBS retrograde_simt)
retrograde_test(schedule_replay_test READS_FILES LIBS retrograde_dep_halide_runtime)
retrograde_test(tune_test LIBS retrograde_tune_parts retrograde_dep_halide_runtime)

# The access graph. Its headers are in the top-level folder.
retrograde_test(access_graph_test access_queries_test dependences_test READS_FILES LIBS retrograde_dep_halide_runtime)
# In shadow, dependences answer for the programs of the gradient suite.
retrograde_test(dependences_shadow_test
  SOURCES autoschedule/dependences_shadow_test.cpp
          gradient/programs_accesses.cpp gradient/programs_large.cpp
          gradient/programs_pathologies.cpp gradient/programs_pointwise.cpp gradient/update_programs.cpp
          gradient/update_reductions.cpp gradient/update_filters.cpp gradient/update_scans.cpp
          gradient/update_steps.cpp
  LIBS retrograde_dep_halide_runtime)
foreach(name access_graph_test access_queries_test dependences_test dependences_shadow_test)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
endforeach()
