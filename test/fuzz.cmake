# Random programs that take minutes, for the preset `fuzz`.

retrograde_fuzz(fuzz_adjoints FROM 200000 TO 218000 STEP 2000)
retrograde_fuzz(fuzz_adjoints FROM 700000 TO 701750 STEP 250 OPTIONS --style workloads)
retrograde_fuzz(fuzz_forms FROM 300000 TO 318000 STEP 2000 OPTIONS --compile 5)
retrograde_fuzz(fuzz_gpu FROM 500000 TO 501800 STEP 200)
retrograde_fuzz(fuzz_moves FROM 900000 TO 903000 STEP 300)
retrograde_fuzz(fuzz_pipelines FROM 100000 TO 119500 STEP 500)
retrograde_fuzz(fuzz_ptx FROM 600000 TO 604500 STEP 500)
retrograde_fuzz(fuzz_schedules FROM 400000 TO 402700 STEP 300)
retrograde_fuzz(fuzz_schedules FROM 800000 TO 800400 STEP 200 OPTIONS --style workloads)

# The tests that run a part of their programs by default.
retrograde_many_programs(adversary_fuzz SOURCES gradient/adversary/adversary_test.cpp EXPORTS
  LIBS gradient_adversary)
retrograde_many_programs(auto_schedule_fuzz SOURCES autoschedule/auto_schedule_test.cpp)
retrograde_many_programs(device_math_fuzz SOURCES unit/codegen/device_math_test.cpp OPTIMIZED READS_FILES
  LIBS retrograde_simt)
retrograde_many_programs(gpu_auto_schedules_fuzz SOURCES autoschedule/gpu_auto_schedules_test.cpp
  LIBS retrograde_simt)
retrograde_many_programs(gpu_gradients_fuzz SOURCES gradient/gpu_gradients_test.cpp ${suite_programs}
  LIBS retrograde_dep_halide_runtime)
retrograde_many_programs(gpu_programs_fuzz SOURCES unit/gpu/gpu_programs_test.cpp support/gpu_programs.cpp
  LIBS retrograde_simt retrograde_dep_halide_runtime)
retrograde_many_programs(gradient_suite_fuzz SOURCES gradient/programs_suite_test.cpp ${suite_programs}
  LIBS retrograde_dep_halide_runtime)
retrograde_many_programs(move_walk_fuzz SOURCES property/move_walk_test.cpp READS_FILES)
retrograde_many_programs(odd_sizes_fuzz SOURCES gradient/odd_sizes_test.cpp
  LIBS retrograde_dep_halide_runtime)
retrograde_many_programs(plan_round_trip_fuzz SOURCES property/plan_round_trip_test.cpp)
retrograde_many_programs(ptx_fuzz SOURCES unit/codegen/ptx_test.cpp support/every_kernel.cpp LAYERS codegen)
retrograde_many_programs(random_fuzz SOURCES property/random_test.cpp)
retrograde_many_programs(update_random_fuzz SOURCES gradient/update_random_test.cpp
  LIBS gradient_adversary)
