# The tool for machines with a GPU, on the simulated device.
foreach(way simulated failing without_device wrong_arguments)
  add_test(NAME gpu_check.${way} COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/gpu_check/check ${way}
    $<TARGET_FILE:gpu_check> ${CMAKE_CURRENT_BINARY_DIR}/gpu_check)
  set_tests_properties(gpu_check.${way} PROPERTIES LABELS gpu_check TIMEOUT 120)
endforeach()
