# Functions compiled ahead of time, called by programs that link no compiler.
if(RETROGRADE_SANITIZER)
  set(test_link_flags -fsanitize=${RETROGRADE_SANITIZER})
endif()
retrograde_test(aot_test)
target_compile_definitions(aot_test PRIVATE
  RETROGRADE_TEST_COMPILE_FLAGS="-idirafter ${RETROGRADE_HALIDE_RUNTIME_INCLUDE} ${test_link_flags}")

set(run_gen ${PROJECT_SOURCE_DIR}/runtime/run_gen)
retrograde_test(run_gen_files_test RUNTIME
  SOURCES unit/aot/run_gen_files_test.cpp ${run_gen}/elements.cpp ${run_gen}/filter.cpp
          ${run_gen}/image_files.cpp ${run_gen}/inputs.cpp ${run_gen}/jpeg_file.cpp ${run_gen}/options.cpp
  LAYERS static_runtime LIBS png jpeg)
target_compile_definitions(run_gen_files_test PRIVATE RETROGRADE_RUN_GEN_PNG RETROGRADE_RUN_GEN_JPEG)

# aot_pipelines writes object files, a registration and a library.
set(aot_folder ${CMAKE_CURRENT_BINARY_DIR}/aot)
set(aot_objects aot_blur aot_blur_context aot_blur_mangled aot_blur_no_query aot_blur_swapped
  aot_blur_unchecked aot_math aot_scalars aot_services aot_table aot_table_given aot_talker aot_tuple)
list(TRANSFORM aot_objects PREPEND ${aot_folder}/)
list(TRANSFORM aot_objects APPEND .o)
set(aot_registration ${aot_folder}/aot_blur.registration.cpp)
set(aot_library ${aot_folder}/aot_variants.a)
add_executable(aot_pipelines support/aot_pipelines.cpp)
target_link_libraries(aot_pipelines PRIVATE retrograde)
add_custom_command(OUTPUT ${aot_objects} ${aot_registration} ${aot_library}
  COMMAND ${CMAKE_COMMAND} -E make_directory ${aot_folder}
  COMMAND aot_pipelines ${aot_folder}
  DEPENDS aot_pipelines VERBATIM)
set_source_files_properties(${aot_objects} PROPERTIES EXTERNAL_OBJECT TRUE GENERATED TRUE)
retrograde_test(aot_call_test SOURCES unit/aot/aot_call_test.cpp ${aot_objects} ${aot_registration}
  LAYERS static_runtime LIBS ${aot_library})
target_include_directories(aot_call_test PRIVATE ${aot_folder})

# The same with kernels, which a generator's program compiles for devices and for the simulated one.
set(gpu_folder ${CMAKE_CURRENT_BINARY_DIR}/aot_gpu)
file(MAKE_DIRECTORY ${gpu_folder})
add_executable(gpu_generator support/gpu_generator.cpp)
target_link_libraries(gpu_generator PRIVATE retrograde_generator_main)
# gpu_filter(<name> <types> <features> <environment>... [FUNCTION <name>]): what the generator writes.
function(gpu_filter name types target)
  cmake_parse_arguments(PARSE_ARGV 3 arg "" "FUNCTION" "")
  set(files ${gpu_folder}/${name}.h)
  if("object" IN_LIST types)
    list(APPEND files ${gpu_folder}/${name}.o)
    set_source_files_properties(${gpu_folder}/${name}.o PROPERTIES EXTERNAL_OBJECT TRUE GENERATED TRUE)
  else()
    list(APPEND files ${gpu_folder}/${name}.a)
  endif()
  if(NOT arg_FUNCTION)
    set(arg_FUNCTION ${name})
  endif()
  list(JOIN types "," types)
  add_custom_command(OUTPUT ${files}
    COMMAND ${CMAKE_COMMAND} -E env ${arg_UNPARSED_ARGUMENTS} $<TARGET_FILE:gpu_generator> -g gpu_filter
      -n ${name} -f ${arg_FUNCTION} -o ${gpu_folder} -e ${types} target=host-cuda-${target}
    DEPENDS gpu_generator VERBATIM)
endfunction()
set(simulated RETROGRADE_GPU=simulated)
gpu_filter(gpu_filter "c_header;object" cuda_capability_80-no_runtime ${simulated})
gpu_filter(space_gpu_filter "c_header;object" no_runtime-c_plus_plus_name_mangling ${simulated}
  FUNCTION space::gpu_filter)
gpu_filter(gpu_filter_devices_only "c_header;object" cuda_capability_90-no_runtime --unset=RETROGRADE_GPU)
gpu_filter(gpu_filter_alone "c_header;static_library" user_context ${simulated})
set(gpu_objects gpu_filter space_gpu_filter gpu_filter_devices_only)
list(TRANSFORM gpu_objects PREPEND ${gpu_folder}/)
list(TRANSFORM gpu_objects APPEND .o)
retrograde_test(aot_gpu_test SOURCES unit/aot/aot_gpu_test.cpp ${gpu_objects} LAYERS static_runtime simt)
retrograde_test(aot_gpu_handlers_test SOURCES unit/aot/aot_gpu_handlers_test.cpp ${gpu_folder}/gpu_filter_alone.a
  LAYERS simt LIBS ${gpu_folder}/gpu_filter_alone.a retrograde_dep_halide_runtime)
foreach(program aot_gpu_test aot_gpu_handlers_test)
  target_include_directories(${program} PRIVATE ${gpu_folder} ${PROJECT_SOURCE_DIR}/runtime)
endforeach()
