# The graph of Funcs.
retrograde_test(associativity_test LAYERS analysis)
retrograde_test(computing_order_test)
retrograde_test(first_reads_test graph_text_test race_checks_test rfactor_test wrappers_test
  TOGETHER graph_tests LIBS retrograde_dep_halide_runtime)
