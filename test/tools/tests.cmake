# The checks that tools/lint runs.
add_test(NAME tools.sizes COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/tools/sizes_test.py)
set_tests_properties(tools.sizes PROPERTIES LABELS tools)
