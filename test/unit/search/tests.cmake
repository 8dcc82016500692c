# Searches over plans.
retrograde_test(search_test LIBS retrograde_dep_halide_runtime)
