# The cost of plans.
retrograde_test(cost_model_properties_test cost_probes_test TOGETHER cost_tests LIBS retrograde_dep_halide_runtime)
add_executable(scratch_compare unit/cost/scratch_compare.cpp)
target_link_libraries(scratch_compare PRIVATE retrograde)
target_compile_options(scratch_compare PRIVATE -O1)
