# Random programs and schedules against the interpreter.
retrograde_test(computed_boxes_test)
retrograde_test(gpu_faults_test LIBS retrograde_simt retrograde_dep_halide_runtime)
retrograde_test(gpu_schedules_test LIBS retrograde_simt)
retrograde_test(interval_property_test LAYERS analysis)
retrograde_test(loop_passes_test LAYERS lower OPTIMIZED)
retrograde_test(move_walk_test READS_FILES)
retrograde_test(plan_round_trip_test)
retrograde_test(random_test)
retrograde_test(simplify_property_test SOURCES property/simplify_test.cpp LAYERS simplify)

# Programs that try random pipelines without end and reduce those that fail; no tests by themselves. fuzz_gpu runs
# kernels on the simulated device, fuzz_ptx gives their PTX to ptxas, fuzz_moves changes plans.
add_library(fuzzing STATIC support/fuzz.cpp)
target_link_libraries(fuzzing PUBLIC retrograde)
target_include_directories(fuzzing PUBLIC ${CMAKE_CURRENT_SOURCE_DIR})
add_executable(fuzz_pipelines property/fuzz.cpp)
target_link_libraries(fuzz_pipelines PRIVATE fuzzing)
add_executable(fuzz_gpu property/fuzz_gpu.cpp)
target_link_libraries(fuzz_gpu PRIVATE fuzzing retrograde_simt)
add_executable(fuzz_moves property/fuzz_moves.cpp)
target_link_libraries(fuzz_moves PRIVATE fuzzing)
add_executable(fuzz_ptx property/fuzz_ptx.cpp)
target_link_libraries(fuzz_ptx PRIVATE fuzzing)
