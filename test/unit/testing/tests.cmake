# The interpreter and the random programs of compiler/testing.
retrograde_test(interpreter_test LAYERS testing LIBS retrograde_dep_halide_runtime)
retrograde_test(random_programs_test LIBS retrograde_dep_halide_runtime)
