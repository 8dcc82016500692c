# The runtime, and code compiled just in time.
retrograde_test(disk_cache_test LAYERS jit lower LIBS retrograde_dep_halide_runtime)
retrograde_test(jit_test RUNTIME LIBS retrograde_dep_halide_runtime)
retrograde_test(jit_handlers_test LIBS retrograde_dep_halide_runtime)
retrograde_test(runtime_test LAYERS runtime LIBS retrograde_dep_halide_runtime)
retrograde_test(thread_pool_test RUNTIME LAYERS static_runtime)
