# Code generation: machine code, kernels and PTX.
retrograde_test(
  codegen_access_test
  codegen_arithmetic_test
  codegen_idioms_test
  codegen_statement_test
  equal_loops_test
  ptxas_test
  TOGETHER codegen_statement_tests LAYERS jit lower LIBS retrograde_dep_halide_runtime)
retrograde_test(
  checked_accesses_test
  costly_arms_test
  fused_sums_test
  vector_access_test
  vector_reduction_test
  TOGETHER codegen_program_tests LIBS retrograde_dep_halide_runtime)
retrograde_test(codegen_math_test OPTIMIZED LAYERS jit lower LIBS retrograde_dep_halide_runtime)
retrograde_test(device_math_test OPTIMIZED READS_FILES LIBS retrograde_simt)
retrograde_test(gpu_assembler_test LAYERS static_runtime simt)
retrograde_test(kernel_text_test SOURCES unit/codegen/kernel_text_test.cpp support/gpu_programs.cpp
  LIBS retrograde_simt retrograde_dep_halide_runtime)
retrograde_test(nested_minima_test LAYERS codegen)
retrograde_test(ptx_test SOURCES unit/codegen/ptx_test.cpp support/every_kernel.cpp LAYERS codegen)
retrograde_test(selectable_test OPTIMIZED LAYERS codegen LIBS retrograde_dep_llvm)
