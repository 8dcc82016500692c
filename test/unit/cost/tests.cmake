# The cost of plans.
retrograde_test(cost_model_properties_test cost_probes_test kernel_cost_test TOGETHER cost_tests LIBS retrograde_dep_halide_runtime)
