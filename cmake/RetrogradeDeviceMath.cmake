# The mathematical functions of kernels, embedded in the library: extracted from libclc's bitcode for NVPTX are the
# functions that codegen/math/math_table.h names, with their callees.
#
# retrograde_device_math(<target>)
find_program(RETROGRADE_LLVM_EXTRACT NAMES llvm-extract PATHS /usr/lib/llvm-19/bin NO_DEFAULT_PATH
  REQUIRED)
find_file(RETROGRADE_LIBCLC NAMES nvptx64--nvidiacl.bc PATHS /usr/lib/clc NO_DEFAULT_PATH REQUIRED)

function(retrograde_device_math target)
  set(one exp log sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh erf)
  set(two pow hypot atan2)
  set(functions)
  foreach(name ${one} ${two})
    string(LENGTH ${name} length)
    foreach(type f d)
      set(types ${type})
      if(name IN_LIST two)
        set(types ${type}${type})
      endif()
      list(APPEND functions --func=_Z${length}${name}${types})
    endforeach()
  endforeach()
  set(bitcode ${CMAKE_CURRENT_BINARY_DIR}/device_math.bc)
  set(source ${CMAKE_CURRENT_BINARY_DIR}/device_math_bytes.cpp)
  add_custom_command(OUTPUT ${bitcode}
    COMMAND ${RETROGRADE_LLVM_EXTRACT} --recursive ${functions} --rglob=. -o ${bitcode} ${RETROGRADE_LIBCLC}
    DEPENDS ${RETROGRADE_LIBCLC} VERBATIM)
  file(GENERATE OUTPUT ${source} CONTENT "asm(R\"(
  .section .rodata
  .balign 16
  .globl retrograde_device_math_begin, retrograde_device_math_end
  .hidden retrograde_device_math_begin, retrograde_device_math_end
retrograde_device_math_begin:
  .incbin \"${bitcode}\"
retrograde_device_math_end:
  .byte 0
  .text
)\");
")
  set_source_files_properties(${source} PROPERTIES OBJECT_DEPENDS ${bitcode}
    SKIP_UNITY_BUILD_INCLUSION ON)
  target_sources(${target} PRIVATE ${source})
endfunction()
