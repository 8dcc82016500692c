# Random pointwise expressions of the stable forms, against dual numbers with as many digits as there are.
add_library(gradient_forms STATIC gradient/forms/check_form.cpp gradient/forms/dual_oracle.cpp
  gradient/forms/expressions.cpp)
target_link_libraries(gradient_forms PUBLIC retrograde_dep_halide_runtime retrograde)
target_include_directories(gradient_forms PUBLIC ${CMAKE_CURRENT_SOURCE_DIR})
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  target_compile_definitions(gradient_forms PRIVATE RETROGRADE_HAS_QUADMATH)
  target_link_libraries(gradient_forms PRIVATE quadmath)
endif()
add_executable(fuzz_forms gradient/forms/fuzz.cpp)
target_link_libraries(fuzz_forms PRIVATE gradient_forms fuzzing)
