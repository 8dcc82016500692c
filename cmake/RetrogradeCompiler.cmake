# Settings for all of our targets: language level, warnings, floating-point rules, sanitizers and ccache.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()
# -O2 rather than -O3: users spend little time in the compiler itself, and it builds faster.
set(CMAKE_CXX_FLAGS_RELEASE "-O2")
set(CMAKE_C_FLAGS_RELEASE "-O2")
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g")
set(CMAKE_C_FLAGS_RELWITHDEBINFO "-O1 -g")

find_program(RETROGRADE_CCACHE ccache)
if(RETROGRADE_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${RETROGRADE_CCACHE})
  set(CMAKE_C_COMPILER_LAUNCHER ${RETROGRADE_CCACHE})
endif()

# The interpreter and the constant folder are oracles: they must compute exactly what IEEE 754 specifies, the same on
# every machine. So the host compiler must neither contract nor reassociate.
add_compile_options(-ffp-contract=off -fno-fast-math)
add_compile_options(-Wall -Wextra)
if(RETROGRADE_WERROR)
  add_compile_options(-Werror)
endif()
# Bind calls inside the shared library to the library itself. This is faster, and a second compiler in the process (the
# differential tests load Halide) cannot interpose on them.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options(-fno-semantic-interposition)
  # GCC collects garbage from 128 MB on, which takes a tenth of its time. A unit of several sources needs 0.5 GB.
  if(RETROGRADE_QUICK_BUILD)
    add_compile_options($<$<COMPILE_LANGUAGE:CXX>:SHELL:--param=ggc-min-heapsize=500000>)
  endif()
endif()

set(RETROGRADE_SANITIZER "" CACHE STRING "address, undefined, thread or nothing")
if(RETROGRADE_SANITIZER)
  add_compile_options(-fsanitize=${RETROGRADE_SANITIZER} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${RETROGRADE_SANITIZER})
  if(RETROGRADE_SANITIZER STREQUAL "undefined")
    add_compile_options(-fno-sanitize-recover=all)
  endif()
endif()
