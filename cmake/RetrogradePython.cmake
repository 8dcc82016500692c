# The interpreter that the Python package is for, and pybind11: RETROGRADE_PYTHON says whether both are there.
#
# Debian's own interpreter unless Python_EXECUTABLE says another: a python3 that stands before it on the PATH has
# neither its packages nor its headers.
if(NOT Python_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python_EXECUTABLE /usr/bin/python3)
endif()
set(PYBIND11_FINDPYTHON ON)
find_package(Python 3.9 QUIET COMPONENTS Interpreter Development.Module)
if(Python_FOUND)
  find_package(pybind11 2.10 CONFIG QUIET)
endif()
option(RETROGRADE_PYTHON "Build the Python package" ${pybind11_FOUND})
if(RETROGRADE_PYTHON AND NOT pybind11_FOUND)
  message(FATAL_ERROR "RETROGRADE_PYTHON needs Python 3.9 with its headers and pybind11 2.10 or newer: "
    "python3-dev and pybind11-dev of Debian. Or set it to OFF.")
endif()

# What an interpreter must be told that loads the package from the build: a sanitized module needs its sanitizer to be
# there before it. What Python itself keeps to the end are no leaks of ours, and what is freed is not to count as memory
# in use. Tests know by RETROGRADE_SANITIZER that the runtime of generated libraries needs the sanitizer to be linked.
set(RETROGRADE_PYTHON_ENVIRONMENT "")
if(RETROGRADE_SANITIZER MATCHES "^(address|thread)$")
  string(SUBSTRING ${RETROGRADE_SANITIZER} 0 1 initial)
  foreach(library lib${initial}san.so libstdc++.so)
    execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=${library} OUTPUT_VARIABLE file
      OUTPUT_STRIP_TRAILING_WHITESPACE)
    list(APPEND preloaded ${file})
  endforeach()
  string(REPLACE ";" ":" preloaded "${preloaded}")
  set(RETROGRADE_PYTHON_ENVIRONMENT LD_PRELOAD=${preloaded} ASAN_OPTIONS=detect_leaks=0:quarantine_size_mb=4
    TSAN_OPTIONS=ignore_noninstrumented_modules=1:die_after_fork=0
    RETROGRADE_SANITIZER=${RETROGRADE_SANITIZER})
endif()
