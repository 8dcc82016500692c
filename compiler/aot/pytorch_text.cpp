// pytorch_text.cpp -- see pytorch_text.h.
#include "aot/pytorch_text.h"

namespace retrograde::aot {

const char* const pytorch_operator_text = R"(
#ifdef RETROGRADE_TORCH_OP
#include <torch/library.h>
#include <torch/csrc/autograd/custom_function.h>
#include <ATen/core/dispatch/Dispatcher.h>

// Registers the operator RETROGRADE_TORCH_NAMESPACE::RETROGRADE_TORCH_OP. The program also defines
//   RETROGRADE_TORCH_SHAPE_<output>   optional: the sizes of an output, as in
//                                       image.sym_size(0), image.sym_size(1) - 2;
//                                     default: the sizes of the first image with as many dimensions
//   RETROGRADE_TORCH_GRADIENT(of)     the wrappers of the gradient's functions, whose header it has included. `of` is
//                                     empty for all gradients, _by_<input> for a single one
// Floating-point numbers are numbers, or tensors without dimensions; such tensors are differentiated like images.
namespace retrograde_torch {
namespace RETROGRADE_TORCH_OP {

constexpr const char* name =
    RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_NAMESPACE) "::" RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP);
using Results = $results$;
$shapes$
inline Results made($parameters$) {
  return Results($empties$);
}

inline Results run($parameters$) {
$empty_variables$  succeed(name, $function$_th_($arguments$, $outputs$));
  return Results($outputs$);
}

constexpr const char* tensors_name = RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP) "$dot_overload$";

inline const auto& found() {
  static const auto handle =
      c10::Dispatcher::singleton().findSchemaOrThrow(name, "$overload$").typed<Results($tensor_types$)>();
  return handle;
}

#ifdef RETROGRADE_TORCH_GRADIENT
constexpr const char* backward_name =
    RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_NAMESPACE) "::" RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP) "_backward";
constexpr int64_t all_gradients = (int64_t{1} << $gradient_count$) - 1;

inline std::vector<at::Tensor> backward_made($backward_parameters$) {
  std::vector<at::Tensor> results;
$gradients_made$  return results;
}

// Computes only the gradients whose bits are set in `wanted`.
inline std::vector<at::Tensor> backward_run($backward_parameters$) {
  std::vector<at::Tensor> results;
  if (wanted == all_gradients) {
$gradient_variables$    succeed(backward_name, RETROGRADE_TORCH_GRADIENT()($values$, $seeds$, $gradient_outputs$));
    results = {$gradient_results$};
    return results;
  }
$gradients_alone$  return results;
}

inline const auto& found_backward() {
  static const auto handle = c10::Dispatcher::singleton()
                                 .findSchemaOrThrow(backward_name, "")
                                 .typed<std::vector<at::Tensor>($backward_types$)>();
  return handle;
}

struct OnlyOnce : torch::autograd::Function<OnlyOnce> {
  static std::vector<at::Tensor> forward(torch::autograd::AutogradContext*, $backward_parameters$) {
    at::AutoDispatchBelowADInplaceOrView below;
    return found_backward().call($backward_arguments$);
  }
  static torch::autograd::variable_list backward(torch::autograd::AutogradContext*, torch::autograd::variable_list) {
    refuse_derivative(name, "its gradient was compiled, and no second derivative");
    return {};
  }
};

inline std::vector<at::Tensor> backward_autograd($backward_parameters$) {
  if (at::GradMode::is_enabled() && ($any_requires_grad$ || $any_seed_requires_grad$))
    return OnlyOnce::apply($backward_arguments$);
  at::AutoDispatchBelowADInplaceOrView below;
  return found_backward().call($backward_arguments$);
}
#endif

struct Function : torch::autograd::Function<Function> {
  static std::vector<at::Tensor> forward(torch::autograd::AutogradContext* context, $tensor_parameters$) {
    at::AutoDispatchBelowADInplaceOrView below;
    context->save_for_backward({$tensors$});
$save_numbers$    return tensors_of(found().call($arguments$));
  }
  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 torch::autograd::variable_list seeds) {
#ifdef RETROGRADE_TORCH_GRADIENT
    const auto saved = context->get_saved_variables();
    int64_t wanted = 0;
$find_wanted$    const auto results = found_backward().call($restored$, $seed_list$);
    size_t next = 0;
    const auto gradient = [&](int64_t bit) { return wanted & bit ? results[next++] : at::Tensor(); };
    return {$autograd_results$};
#else
    refuse_derivative(name, "no gradient was compiled: it was made without GRADIENT");
    return {};
#endif
  }
};

inline Results autograd(c10::DispatchKeySet keys, $tensor_parameters$) {
  if (at::GradMode::is_enabled() && ($any_requires_grad$)) {
    const auto results = Function::apply($arguments$);
    return $results_of_apply$;
  }
  return found().redispatch(keys & c10::after_autograd_keyset, $arguments$);
}

inline Results refuse_device($tensor_parameters$) { refuse_elsewhere(name, $place$); }
$numbers$
TORCH_LIBRARY_FRAGMENT(RETROGRADE_TORCH_NAMESPACE, library) {
  library.def(RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP) "$dot_overload$($tensor_schema$) -> $results_schema$");
  library.impl(tensors_name, key_of($place$), TORCH_FN($run$));
  library.impl(tensors_name, other_key($place$), TORCH_FN(refuse_device));
  library.impl(tensors_name, c10::DispatchKey::Meta, TORCH_FN($made$));
  library.impl(tensors_name, c10::DispatchKey::Autograd, TORCH_FN(autograd));
$register_numbers$#ifdef RETROGRADE_TORCH_GRADIENT
  library.def(RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP) "_backward($backward_schema$) -> Tensor[]");
  library.impl(RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP) "_backward", key_of($place$), TORCH_FN(backward_run));
  library.impl(RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP) "_backward", c10::DispatchKey::Meta, TORCH_FN(backward_made));
  library.impl(RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP) "_backward", c10::DispatchKey::Autograd,
               TORCH_FN(backward_autograd));
#endif
}

const bool has_error_handler = (halide_set_error_handler(note_error), true);

}  // namespace RETROGRADE_TORCH_OP
}  // namespace retrograde_torch
#undef RETROGRADE_TORCH_OP
#endif
)";

const char* const pytorch_numbers_text = R"(
inline Results made_of_tensors($tensor_parameters$) { return made($values$); }
inline Results run_of_tensors($tensor_parameters$) { return run($values$); }

inline Results autograd_of_numbers(c10::DispatchKeySet keys, $parameters$) {
  if (at::GradMode::is_enabled() && ($any_image_requires_grad$)) {
    const auto results = Function::apply($boxed_arguments$);
    return $results_of_apply$;
  }
  static const auto handle =
      c10::Dispatcher::singleton().findSchemaOrThrow(name, "").typed<Results($types$)>();
  return handle.redispatch(keys & c10::after_autograd_keyset, $arguments$);
}

inline Results refuse_device_of_numbers($parameters$) { refuse_elsewhere(name, $place$); }
)";

// Registered after the overload for tensors: otherwise this one would convert a caller's tensor to a number and lose
// its gradient.
const char* const pytorch_register_numbers_text =
    R"(  library.def(RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP) "($schema$) -> $results_schema$");
  library.impl(RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP), key_of($place$), TORCH_FN(run));
  library.impl(RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP), other_key($place$), TORCH_FN(refuse_device_of_numbers));
  library.impl(RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP), c10::DispatchKey::Meta, TORCH_FN(made));
  library.impl(RETROGRADE_TORCH_TEXT(RETROGRADE_TORCH_OP), c10::DispatchKey::Autograd, TORCH_FN(autograd_of_numbers));
)";

const char* const pytorch_helpers = R"(
#ifndef RETROGRADE_TORCH_HELPERS
#define RETROGRADE_TORCH_HELPERS
#define RETROGRADE_TORCH_TEXT_OF(word) #word
#define RETROGRADE_TORCH_TEXT(word) RETROGRADE_TORCH_TEXT_OF(word)

namespace retrograde_torch {

// Where the code runs: on the CPU, or as kernels on RETROGRADE_TORCH_DEVICE. With the simulated device
// (RETROGRADE_GPU=simulated), RETROGRADE_TORCH_DEVICE is at::kCPU, because its memory is the host's.
enum class Place { host, device };
#ifndef RETROGRADE_TORCH_DEVICE
#define RETROGRADE_TORCH_DEVICE at::kCUDA
#endif

constexpr at::DeviceType type_of(Place place) { return place == Place::host ? at::kCPU : RETROGRADE_TORCH_DEVICE; }
constexpr c10::DispatchKey key_of(Place place) {
  return type_of(place) == at::kCPU ? c10::DispatchKey::CPU : c10::DispatchKey::CUDA;
}
constexpr c10::DispatchKey other_key(Place place) {
  return type_of(place) == at::kCPU ? c10::DispatchKey::CUDA : c10::DispatchKey::CPU;
}

inline std::string& last_error() {
  static thread_local std::string text;
  return text;
}
inline void note_error(void*, const char* text) { last_error() = text; }
inline void succeed(const char* name, int code) {
  if (code == 0) return;
  std::string why;
  why.swap(last_error());
  if (why.empty()) why = "cannot call \"" + std::string(name) + "\": error code " + std::to_string(code);
  TORCH_CHECK(false, why);
}

// A tensor as a buffer, with its axes in reverse order. It is copied only if it is an input whose last axis is not
// dense.
template <int Rank>
struct View {
  View(const char* function, const char* argument, const at::Tensor& tensor, halide_type_t type,
       at::ScalarType scalar_type, bool is_output, Place place = Place::host)
      : kept(tensor) {
    TORCH_CHECK(tensor.device().type() == type_of(place) && tensor.scalar_type() == scalar_type && tensor.dim() == Rank,
                "cannot call \"", function, "\": \"", argument, "\" is a tensor of ",
                place == Place::host ? "the CPU" : "a GPU", " of ", scalar_type, " over ", Rank,
                " dimensions; given is one of ", tensor.device(), " of ", tensor.scalar_type(), " with sizes ",
                tensor.sizes(), ". Convert it with tensor.to().");
    if (Rank > 0 && tensor.size(Rank - 1) > 1 && tensor.stride(Rank - 1) != 1) {
      TORCH_CHECK(!is_output, "cannot call \"", function, "\": the last axis of an output is dense; \"", argument,
                  "\" has strides ", tensor.strides(), ". Give a contiguous tensor.");
      kept = tensor.contiguous();
    }
    for (int axis = 0; axis < Rank; axis++) {
      // An axis with at most one element may have any stride, because the stride is never used.
      const int64_t size = kept.size(axis), stride = size > 1 ? kept.stride(axis) : 1;
      TORCH_CHECK(size <= INT32_MAX && stride <= INT32_MAX, "cannot call \"", function,
                  "\": extents and strides fit int32; \"", argument, "\" has sizes ", kept.sizes(),
                  ". Split the tensor.");
      dimensions[Rank - 1 - axis] = halide_dimension_t(0, static_cast<int32_t>(size), static_cast<int32_t>(stride));
    }
    static char nothing[64];  // a buffer without an address would be a bounds query
    raw.host = static_cast<uint8_t*>(kept.numel() > 0 ? kept.data_ptr() : nothing);
    raw.type = type;
    raw.dimensions = Rank;
    raw.dim = dimensions;
  }
  View(const View&) = delete;
  at::Tensor kept;
  halide_dimension_t dimensions[Rank > 0 ? Rank : 1];
  halide_buffer_t raw{};
};

inline void check_rank(const char* function, const char* argument, const at::Tensor& tensor, int64_t rank) {
  TORCH_CHECK(tensor.dim() == rank, "cannot call \"", function, "\": \"", argument, "\" has ", rank,
              " dimensions; given is one with sizes ", tensor.sizes(), ". Give a tensor of that many dimensions.");
}

// The value of a number passed as a tensor; 0 if the tensor has no value yet (sizes do not depend on it).
inline double number_of(const char* function, const char* argument, const at::Tensor& number) {
  TORCH_CHECK(number.dim() == 0 && at::isFloatingType(number.scalar_type()), "cannot call \"", function, "\": \"",
              argument, "\" is a floating-point number, or a tensor of one without dimensions; given is one of ",
              number.scalar_type(), " with sizes ", number.sizes(), ". Take an element of it.");
  return number.is_meta() ? 0.0 : number.item<double>();
}

[[noreturn]] inline void refuse_derivative(const char* name, const char* why) {
  TORCH_CHECK_NOT_IMPLEMENTED(false, "cannot differentiate \"", name,
                              "\": derivatives are compiled ahead of time; ", why, ". Make the operator in Python, with retrograde.torch.operator.");
  throw std::logic_error("not reached");
}
[[noreturn]] inline void refuse_elsewhere(const char* name, Place place) {
  if (place == Place::host) {
    TORCH_CHECK_NOT_IMPLEMENTED(false, "cannot call \"", name, "\" on CUDA tensors: it was compiled for the CPU "
                                "only. Move the tensors with tensor.cpu(), or compile it with "
                                "FEATURES cuda.");
  }
  TORCH_CHECK_NOT_IMPLEMENTED(false, "cannot call \"", name, "\" on CPU tensors: it was compiled for GPUs, with "
                              "FEATURES cuda. Move the tensors with tensor.cuda().");
  throw std::logic_error("not reached");
}

inline std::vector<at::Tensor> tensors_of(at::Tensor result) { return {std::move(result)}; }
template <class... Tensors>
std::vector<at::Tensor> tensors_of(std::tuple<Tensors...> results) {
  return std::apply([](auto&&... each) { return std::vector<at::Tensor>{std::move(each)...}; }, std::move(results));
}

}  // namespace retrograde_torch
#endif
)";

const char* const pytorch_device_helpers = R"(
#ifndef RETROGRADE_TORCH_DEVICE_HELPERS
#define RETROGRADE_TORCH_DEVICE_HELPERS
#include <HalideRuntimeCuda.h>
#include <c10/core/DeviceGuard.h>
#include <c10/core/impl/VirtualGuardImpl.h>

extern "C" int (*halide_set_cuda_get_stream(int (*)(void*, void*, void**)))(void*, void*, void**);

namespace retrograde_torch {

// A tensor that stays in device memory.
template <int Rank>
struct DeviceView : View<Rank> {
  DeviceView(const char* function, const char* argument, const at::Tensor& tensor, halide_type_t type,
             at::ScalarType scalar_type, bool is_output)
      : View<Rank>(function, argument, tensor, type, scalar_type, is_output, Place::device) {
    if (this->kept.numel() == 0) return;
    const auto address = reinterpret_cast<uintptr_t>(this->kept.data_ptr());
    this->raw.host = nullptr;
    succeed(function, halide_cuda_wrap_device_ptr(nullptr, &this->raw, address));
    this->raw.set_device_dirty();
  }
  ~DeviceView() {
    if (this->raw.device) halide_cuda_detach_device_ptr(nullptr, &this->raw);
  }
};

// The driver's stream behind a PyTorch stream; before PyTorch 2 only the default stream is accessible.
template <class Stream>
auto handle_of(const char*, const Stream& stream, int) -> decltype(static_cast<void*>(stream.native_handle())) {
  return stream.native_handle();
}
template <class Stream>
void* handle_of(const char* function, const Stream& stream, long) {
  TORCH_CHECK(stream.id() == 0, "cannot call \"", function, "\" on ", stream, ": this PyTorch does not tell which of "
              "the driver's it is. Call it on the default stream, or take a later PyTorch.");
  return nullptr;
}

// During its lifetime, the tensor's device is current, and kernels run on that device's current stream.
class OnDevice {
 public:
  OnDevice(const char* function, const at::Tensor& tensor) : guard_(tensor.device()), before_(stream()) {
    static const bool is_known = (halide_set_cuda_get_stream(give_stream), true);
    if (is_known && tensor.device().is_cuda()) {
      const c10::impl::VirtualGuardImpl device(tensor.device().type());
      stream() = handle_of(function, device.getStream(tensor.device()), 0);
    }
  }
  OnDevice(const OnDevice&) = delete;
  ~OnDevice() { stream() = before_; }

 private:
  static void*& stream() {
    static thread_local void* current = nullptr;
    return current;
  }
  static int give_stream(void*, void*, void** given) {
    *given = stream();
    return 0;
  }
  c10::DeviceGuard guard_;
  void* before_;
};

}  // namespace retrograde_torch
#endif
)";

}  // namespace retrograde::aot
