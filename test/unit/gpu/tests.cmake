# Kernels: buffers, copies, barriers and the runtime, on the simulated device.
retrograde_test(
  gpu_buffers_test
  gpu_errors_test
  gpu_failures_test
  gpu_runtime_test
  LAYERS static_runtime simt)
retrograde_test(device_buffers_test gpu_copies_test LIBS retrograde_simt retrograde_dep_halide_runtime)
retrograde_test(explain_kernels_test LIBS retrograde_dep_halide_runtime retrograde_dep_json)
retrograde_test(gpu_barriers_test LIBS retrograde_simt)
retrograde_test(gpu_check_records_test LAYERS diagnostics LIBS retrograde_gpu_check_parts)
retrograde_test(gpu_programs_test SOURCES unit/gpu/gpu_programs_test.cpp support/gpu_programs.cpp
  LIBS retrograde_simt retrograde_dep_halide_runtime)
retrograde_test(gpu_run_test)
retrograde_test(insert_barriers_test LAYERS lower)
retrograde_test(simt_driver_test simt_test LAYERS simt)
