# Finds pybind11 and the interpreter for the Python package; RETROGRADE_PYTHON says whether both exist.
#
# The interpreter is Debian's unless Python_EXECUTABLE names another: another python3 earlier on the PATH has neither
# Debian's packages nor its headers.
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

# Environment for interpreters that load the package from the build. A sanitized module needs its sanitizer loaded
# first. Leak checks ignore what Python itself keeps until exit. Tests read RETROGRADE_SANITIZER to know that runtimes
# of generated libraries must be linked with the sanitizer.
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
