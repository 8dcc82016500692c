# Builds PyTorch operators from generators, ahead of time. They run without the compiler and without our Python package.
#
#   retrograde_add_torch_op(<target> FROM <generator-target> GENERATOR <name> [GRADIENT] [NAMESPACE <ns>]
#     [PYTHON <interpreter>] [CXX_STANDARD 17|20] [SHAPE <output>=<sizes>...] [PARAMS <param=value>...]
#     [AUTOSCHEDULER <name>] [FEATURES <feature>...] [SIMULATED_GPU])
#     Makes a module <target>.so for torch.ops.load_library. Then torch.ops.<ns>.<target>(...) takes the generator's
#     inputs and returns its outputs. NAMESPACE defaults to "retrograde".
#     GRADIENT: autograd can differentiate the operator once, with respect to images and to floating-point numbers
#     that are passed as tensors without dimensions. Only the requested gradients are computed (-d separate).
#     FEATURES cuda: the operator takes CUDA tensors only, and runs kernels on the current stream. Generators without
#     a GPU schedule need AUTOSCHEDULER. SIMULATED_GPU: kernels run on the simulated device, for CPU tensors.
#     PYTHON: the interpreter whose PyTorch it is compiled for, "/usr/bin/python3" by default. Include and library
#     paths come from it, so no CUDA toolkit is needed if that PyTorch supports CUDA.
#     SHAPE: the sizes of an output in PyTorch's order, as C++ over the inputs' names, for example
#     "blur=image.sym_size(0), image.sym_size(1) - 2". Default: the sizes of the first image with as many dimensions.
#
# The module consists of the function and its gradient (add_retrograde_library), the header that the generator writes,
# <target>_forward.pytorch.h, and <target>.torch.cpp, which this function writes.
# writes, and what the generator wrote for it, <target>_forward.pytorch.h.

# Finds an interpreter's PyTorch (include folders, libraries, the ABI of strings), once for each interpreter.
function(_retrograde_find_torch python)
  string(MAKE_C_IDENTIFIER ${python} id)
  if(DEFINED RETROGRADE_TORCH_LIBRARIES_${id})
    return()
  endif()
  set(script [[
import os, torch
root = os.path.dirname(torch.__file__)
folders = [os.path.join(root, "include"), os.path.join(root, "include/torch/csrc/api/include"),
           "/usr/include/torch/csrc/api/include"]
if not os.path.exists(os.path.join(root, "include/torch/csrc/api/include")):
    folders.append("/usr/include")
print(";".join(f for f in folders if os.path.isdir(f)))
print(";".join(os.path.join(root, "lib", f"lib{n}.so") for n in ("c10", "torch_cpu", "torch")))
print(int(torch._C._GLIBCXX_USE_CXX11_ABI))
print(torch.__version__)
]])
  execute_process(COMMAND ${python} -c "${script}" OUTPUT_VARIABLE output ERROR_VARIABLE error RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "retrograde_add_torch_op: ${python} has no PyTorch: ${error}. Install one for it, or name "
      "another interpreter with PYTHON.")
  endif()
  string(REGEX MATCH "^([^\n]*)\n([^\n]*)\n([^\n]*)\n([^\n]*)" output "${output}")
  set(RETROGRADE_TORCH_INCLUDES_${id} "${CMAKE_MATCH_1}" CACHE INTERNAL "")
  set(RETROGRADE_TORCH_LIBRARIES_${id} "${CMAKE_MATCH_2}" CACHE INTERNAL "")
  set(RETROGRADE_TORCH_ABI_${id} "${CMAKE_MATCH_3}" CACHE INTERNAL "")
  message(STATUS "PyTorch ${CMAKE_MATCH_4} of ${python}")
endfunction()

function(retrograde_add_torch_op target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "GRADIENT;SIMULATED_GPU"
    "FROM;GENERATOR;NAMESPACE;PYTHON;CXX_STANDARD;AUTOSCHEDULER" "SHAPE;PARAMS;FEATURES")
  set(asked "retrograde_add_torch_op(${target})")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "${asked}: unknown arguments ${arg_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT arg_GENERATOR)
    message(FATAL_ERROR "${asked}: GENERATOR names the generator, and is missing")
  endif()
  foreach(default NAMESPACE=retrograde PYTHON=/usr/bin/python3 CXX_STANDARD=17)
    string(REGEX MATCH "^([A-Z_]+)=(.*)$" default ${default})
    if(NOT arg_${CMAKE_MATCH_1})
      set(arg_${CMAKE_MATCH_1} ${CMAKE_MATCH_2})
    endif()
  endforeach()
  _retrograde_find_torch(${arg_PYTHON})
  string(MAKE_C_IDENTIFIER ${arg_PYTHON} id)

  # ---- the code ----
  set(options FROM ${arg_FROM} GENERATOR ${arg_GENERATOR} PARAMS ${arg_PARAMS})
  if(arg_AUTOSCHEDULER)
    list(APPEND options AUTOSCHEDULER ${arg_AUTOSCHEDULER})
  endif()
  if(arg_FEATURES)
    list(APPEND options FEATURES ${arg_FEATURES})
  endif()
  set(place)
  if(arg_SIMULATED_GPU)
    list(APPEND options SIMULATED_GPU)
    set(place "#define RETROGRADE_TORCH_DEVICE at::kCPU\n")
  endif()
  set(parts ${target}_forward)
  add_retrograde_library(${target}_forward ${options} PYTORCH_WRAPPER wrapper)
  set(text "// Written by retrograde_add_torch_op: the operator ${arg_NAMESPACE}::${target}.\n${place}")
  if(arg_GRADIENT)
    list(APPEND parts ${target}_gradient)
    add_retrograde_library(${target}_gradient ${options} SEPARATE_GRADIENTS PYTORCH_WRAPPER gradient_wrapper)
    string(APPEND text "#include \"${gradient_wrapper}\"\n"
      "#define RETROGRADE_TORCH_GRADIENT(of) ${target}_gradient##of##_th_\n")
  endif()
  string(APPEND text "#define RETROGRADE_TORCH_NAMESPACE ${arg_NAMESPACE}\n#define RETROGRADE_TORCH_OP ${target}\n")
  foreach(shape IN LISTS arg_SHAPE)
    if(NOT shape MATCHES "^([A-Za-z_0-9]+)=(.+)$")
      message(FATAL_ERROR "${asked}: SHAPE is <output>=<sizes>, \"${shape}\" is not")
    endif()
    string(APPEND text "#define RETROGRADE_TORCH_SHAPE_${CMAKE_MATCH_1} ${CMAKE_MATCH_2}\n")
  endforeach()
  string(APPEND text "#include \"${wrapper}\"\n")
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${target}.torch.cpp)
  file(GENERATE OUTPUT ${source} CONTENT "${text}")

  # ---- the module ----
  add_library(${target} MODULE ${source})
  target_link_libraries(${target} PRIVATE ${parts} ${RETROGRADE_TORCH_LIBRARIES_${id}})
  target_include_directories(${target} SYSTEM PRIVATE ${RETROGRADE_TORCH_INCLUDES_${id}})
  target_compile_definitions(${target} PRIVATE _GLIBCXX_USE_CXX11_ABI=${RETROGRADE_TORCH_ABI_${id}})
  # Hide the runtime's symbols, because another module may contain another version of it.
  target_link_options(${target} PRIVATE -Wl,--exclude-libs,ALL)
  set_target_properties(${target} PROPERTIES PREFIX "" CXX_STANDARD ${arg_CXX_STANDARD} CXX_STANDARD_REQUIRED ON
    CXX_EXTENSIONS OFF CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON PRECOMPILE_HEADERS "")
endfunction()
