# Functions compiled for AArch64, run by qemu.
find_program(RETROGRADE_QEMU_ARM qemu-aarch64)
if(RETROGRADE_ARM_CXX AND RETROGRADE_QEMU_ARM)
  add_test(NAME cross.aarch64 COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/cross/check
    $<TARGET_FILE:aot_pipelines> ${RETROGRADE_ARM_CXX} ${RETROGRADE_QEMU_ARM}
    ${RETROGRADE_HALIDE_RUNTIME_INCLUDE} ${CMAKE_CURRENT_BINARY_DIR}/cross)
  set_tests_properties(cross.aarch64 PROPERTIES LABELS cross TIMEOUT 300)
endif()
