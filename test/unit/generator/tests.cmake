# Generators.
retrograde_test(abstract_generator_test LIBS retrograde_halide_compat)
retrograde_test(generator_test EXPORTS)

# A generator writes a stub, the header by which another program uses it.
add_executable(stub_inner support/stub_inner_generator.cpp)
target_link_libraries(stub_inner PRIVATE retrograde_halide_compat retrograde_generator_main)
add_custom_command(
  OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/stub_inner.stub.h ${CMAKE_CURRENT_BINARY_DIR}/stub_inner.schedule.h
         ${CMAKE_CURRENT_BINARY_DIR}/stub_configured.stub.h
  COMMAND stub_inner -g stub_inner -e cpp_stub -o ${CMAKE_CURRENT_BINARY_DIR}
  COMMAND stub_inner -g stub_configured -e cpp_stub -o ${CMAKE_CURRENT_BINARY_DIR}
  COMMAND stub_inner -g stub_inner -e schedule -o ${CMAKE_CURRENT_BINARY_DIR} target=host many.size=2
          open.type=uint8
  DEPENDS stub_inner VERBATIM)
retrograde_test(generator_stub_test
  SOURCES unit/generator/generator_stub_test.cpp support/stub_inner_generator.cpp
          ${CMAKE_CURRENT_BINARY_DIR}/stub_inner.stub.h
          ${CMAKE_CURRENT_BINARY_DIR}/stub_inner.schedule.h
  LIBS retrograde_halide_compat)
target_include_directories(generator_stub_test PRIVATE ${CMAKE_CURRENT_BINARY_DIR})
