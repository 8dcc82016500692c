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
