# IR text before and after each pass, and generated sections of documentation pages.
retrograde_test(derivatives_page_test LAYERS autodiff READS_FILES)
retrograde_test(gpu_page_test READS_FILES LIBS retrograde_simt retrograde_dep_halide_runtime)
retrograde_test(graph_golden_test LAYERS autodiff READS_FILES LIBS retrograde_opt_parts)
retrograde_test(lower_golden_test LAYERS lower READS_FILES)
retrograde_test(pipeline_golden_test LAYERS lower READS_FILES LIBS retrograde_opt_parts)
retrograde_test(schedule_log_test scheduling_page_test READS_FILES LIBS retrograde_dep_halide_runtime)
