// callable.cpp -- binds Callable, a compiled pipeline as a function of its arguments and outputs, and the faster calls
// on tensors of PyTorch.
#include "frontend/run/callable.h"

#include <algorithm>
#include <chrono>

#include "any_stride.h"
#include "bind_all.h"
#include "binding.h"
#include "buffer_memory.h"
#include "func_class.h"
#include "numbers.h"
#include "presumed_strides.h"
#include "runnable.h"
#include "tensor_memory.h"
#include "unlocked.h"

namespace retrograde::frontend {

// Calls with an argument list whose length is known at run time.
struct DynamicCall {
  using Value = Callable::Value;
  static Value value_of(const Buffer<>& buffer) { return Callable::value_of(buffer); }
  static Value value_of(const Runtime::Buffer<>& buffer) { return Callable::value_of(buffer); }
  static Value value_of(const ir::Scalar& scalar) {
    return {nullptr, scalar, false, scalar.type, -1};
  }
  static void call(const Callable& callable, const std::vector<Value>& values,
                   JITUserContext* context = nullptr) {
    callable.call(context, values);
  }
};

}  // namespace retrograde::frontend

namespace retrograde::python {

namespace {

using frontend::DynamicCall;
using py::arg;
using Parameter = std::shared_ptr<graph::ParameterContents>;

// The context of a call that uses the current CUDA context and a given stream.
struct OnStream : JITUserContext {
  explicit OnStream(void* cuda_stream) : stream(cuda_stream) {
    handlers.custom_cuda_get_stream = [](JITUserContext* context, void*, void** result) {
      *result = static_cast<OnStream*>(context)->stream;
      return 0;
    };
  }
  void* stream;
};

// The compiled pipeline. An array whose innermost axis is not dense makes it recompile once (any_stride.h), and so does
// one that is not dense although its first axes are short (presumed_strides.h).
class Bound {
 public:
  using Compile = std::function<Callable()>;
  Bound(Compile compile, std::vector<Argument> args, std::vector<Parameter> parameters,
        std::vector<Parameter> outputs, const std::vector<std::string>& output_names)
      : compile_(std::move(compile)),
        args_(std::move(args)),
        parameters_(std::move(parameters)),
        outputs_(std::move(outputs)),
        strides_(std::make_shared<PresumedStrides>(all_parameters())) {
    compile_again();
    for (const Argument& arg : args_) {
      counts_ |= arg.is_scalar() && !arg.type.is_float();
      names_.push_back(given_name(arg.name));
    }
    for (const std::string& name : output_names) names_.push_back(given_name(name));
  }

  void call(const py::args& positional, const py::kwargs& named) {
    const py::tuple arguments = named.empty() ? py::tuple(positional) : in_order(positional, named);
    std::vector<Buffer<>> buffers(arguments.size());
    std::vector<DynamicCall::Value> values(arguments.size());
    for (size_t i = 0; i < arguments.size(); i++) {
      if (i < args_.size() && args_[i].is_scalar()) {
        values[i] = DynamicCall::value_of(scalar_of(args_[i].type, arguments[i]));
        continue;
      }
      try {
        buffers[i] = arguments[i].cast<Buffer<>>();
      } catch (const py::cast_error&) {
        throw py::type_error((i < names_.size() ? quoted(names_[i]) : "a buffer") +
                             " is an array, not " + std::string(py::repr(arguments[i])));
      }
      if (i >= args_.size()) check_writable(buffers[i], "call a Callable");
      lift(i, buffers[i]);
      values[i] = DynamicCall::value_of(buffers[i]);
    }
    if (is_stale()) compile_again();
    unlocked([callable = callable_, buffers, values](const Interruption&) {
      DynamicCall::call(callable, values);
    });
  }

  // Calls on tensors of PyTorch; the caller has checked the element types. A number is a tensor without dimensions.
  // Optimised for low overhead, for calls that compute little.
  void call_tensors(const py::tuple& arguments) {
    auto [tensors, elements] = tensors_of(arguments);
    run(arguments, elements, std::move(tensors));
  }

  // Calls on tensors in device memory, except for numbers. The work is queued in a stream of this thread's current CUDA
  // context and may not have finished when this returns.
  // Requires: the driver knows the tensors' memory (RuntimeError); kernels alone use it (RuntimeError).
  void call_tensors_on_device(const py::tuple& arguments, uintptr_t stream) {
    auto [tensors, elements] = tensors_of(arguments);
    OnStream context(reinterpret_cast<void*>(stream));
    const py::gil_scoped_release release;
    std::vector<Buffer<>> there;
    for (size_t i = 0; i < arguments.size(); i++) {
      if (tensors.buffers[i].number_of_elements() == 0 || !tensors.buffers[i].data()) continue;
      there.push_back(on_device(tensors.buffers[i], parameter_of_argument(i)));
      tensors.values[i] = DynamicCall::value_of(there.back());
    }
    try {
      DynamicCall::call(callable_, tensors.values, &context);
    } catch (const RuntimeError& failed) {
      // A host stage requested elements, but wrapped device memory has no copy on the host.
      if (failed.code() != halide_error_code_copy_to_host_failed &&
          failed.code() != halide_error_code_host_is_null)
        throw;
      refuse_host_stage(failed);
    }
  }

 private:
  // The user's name, without the number that makes it unique.
  static std::string given_name(const std::string& name) { return name.substr(0, name.find('$')); }

  // Arguments and outputs in the order of the function.
  py::tuple in_order(const py::args& positional, const py::kwargs& named) const {
    std::string all;
    for (const std::string& name : names_) all += (all.empty() ? "" : ", ") + name;
    const auto refuse = [&](const std::string& what) {
      throw py::type_error("this Callable takes " + all + ": " + what);
    };
    if (positional.size() > names_.size()) refuse(text(positional.size(), " were given"));
    std::vector<py::object> values(names_.size());
    for (size_t i = 0; i < positional.size(); i++) values[i] = positional[i];
    for (const auto& [key, value] : named) {
      const auto name = key.cast<std::string>();
      const auto found = std::find(names_.begin(), names_.end(), name);
      if (found == names_.end()) refuse(quoted(name) + " is none of them");
      py::object& place = values[static_cast<size_t>(found - names_.begin())];
      if (place) refuse(quoted(name) + " is given twice");
      place = py::reinterpret_borrow<py::object>(value);
    }
    py::tuple result(names_.size());
    for (size_t i = 0; i < names_.size(); i++) {
      if (!values[i]) refuse(quoted(names_[i]) + " is missing");
      result[i] = values[i];
    }
    return result;
  }

  // The buffers and scalars of a call. `values` points into `buffers`; the pointers stay valid after a move.
  struct Tensors {
    explicit Tensors(size_t count) : buffers(count), values(count) {}
    std::vector<Runtime::Buffer<>> buffers;
    std::vector<DynamicCall::Value> values;
  };

  // Buffers of arguments and outputs, and their total number of elements. Recompiles if a stride requires it.
  std::pair<Tensors, int64_t> tensors_of(const py::tuple& arguments) {
    if (arguments.size() != args_.size() + outputs_.size())
      throw py::type_error("a Callable takes its arguments, then its output buffers");
    Tensors tensors(arguments.size());
    int64_t elements = 0;
    for (size_t i = 0; i < arguments.size(); i++) {
      if (i < args_.size() && args_[i].is_scalar()) {
        tensors.values[i] = DynamicCall::value_of(scalar_of_tensor(arguments[i], args_[i].type));
        continue;
      }
      const Parameter& parameter = parameter_of_argument(i);
      Runtime::Buffer<>& buffer = tensors.buffers[i];
      buffer = buffer_of_tensor(arguments[i], i < args_.size() ? args_[i].type : parameter->type);
      if (parameter && buffer.dimensions() > 0) lift(i, *parameter, buffer);
      elements += static_cast<int64_t>(buffer.number_of_elements());
      tensors.values[i] = DynamicCall::value_of(buffer);
    }
    if (is_stale()) compile_again();
    return {std::move(tensors), elements};
  }

  [[noreturn]] static void refuse_host_stage(const RuntimeError& failed) {
    call_error("run a pipeline on tensors of a device", "kernels alone read and write them",
               text("a stage of it runs on the host, where: ", failed.what()),
               "Give it no schedule, so that auto_schedule() makes kernels, or one with "
               "gpu_tile(); leave out print() "
               "and stages of C functions; or move the tensors with tensor.cpu()",
               failed.code());
  }

  // A Buffer whose device memory is at the tensor's address.
  static Buffer<> on_device(const Runtime::Buffer<>& tensor, const Parameter& parameter) {
    Buffer<> moved(tensor, parameter ? parameter->name : "");
    halide_buffer_t& raw = *moved.raw_buffer();
    const auto address = reinterpret_cast<uintptr_t>(raw.host);
    raw.host = nullptr;
    moved.device_wrap_native(DeviceAPI::CUDA, address);
    moved.set_device_dirty();
    return moved;
  }

  // Short calls run on this thread, because a worker thread for Ctrl-C would cost more than the call. A call counts as
  // short if an earlier one with at least as many elements was short. With an integer argument nothing is known,
  // since it may be an iteration count.
  void run(const py::tuple& arguments, int64_t elements, Tensors tensors) {
    const bool may_be_short = !counts_ && elements <= most_short_elements;
    const Callable callable = callable_;
    if (may_be_short && elements <= short_elements_) {
      const py::gil_scoped_release release;
      DynamicCall::call(callable, tensors.values);
      return;
    }
    const auto start = std::chrono::steady_clock::now();
    auto kept = std::make_shared<Tensors>(std::move(tensors));
    unlocked([callable, kept, owner = keep(arguments)](const Interruption&) {
      DynamicCall::call(callable, kept->values);
    });
    if (may_be_short && std::chrono::steady_clock::now() - start < short_time)
      short_elements_ = elements;
  }

  void compile_again() {
    const size_t lifted = count_lifted();
    callable_ = unlocked([compile = compile_, strides = strides_](const Interruption&) {
      return strides->compile(compile);
    });
    lifted_ = lifted;
    are_strides_wrong_ = false;
  }
  bool is_stale() const { return are_strides_wrong_ || count_lifted() != lifted_; }

  std::vector<Parameter> all_parameters() const {
    std::vector<Parameter> result = parameters_;
    result.insert(result.end(), outputs_.begin(), outputs_.end());
    return result;
  }

  const Parameter& parameter_of_argument(size_t i) const {
    return i < args_.size() ? parameters_[i] : outputs_[i - args_.size()];
  }

  // Notes what an array lacks of what the compiled code relies on.
  template <class AnyBuffer>
  void lift(size_t i, graph::ParameterContents& parameter, const AnyBuffer& buffer) {
    allow_stride(parameter, buffer.dim(0).stride(), buffer.dim(0).extent());
    are_strides_wrong_ |= !strides_->fit(i, buffer);
  }
  void lift(size_t i, const Buffer<>& buffer) {
    if (i >= args_.size() + outputs_.size() || !buffer.defined() || buffer.dimensions() == 0)
      return;
    if (const Parameter& parameter = parameter_of_argument(i)) lift(i, *parameter, buffer);
  }

  // Number of parameters whose dimension 0 need not be dense; another Callable with the same parameters may have
  // removed the assumption.
  size_t count_lifted() const {
    size_t count = 0;
    for (const auto* parameters : {&parameters_, &outputs_}) {
      for (const Parameter& parameter : *parameters)
        count +=
            parameter && !parameter->constraints.empty() && parameter->constraints[0].any_stride;
    }
    return count;
  }

  static constexpr auto short_time = std::chrono::milliseconds(1);
  static constexpr int64_t most_short_elements = 1 << 16;

  Compile compile_;
  std::vector<Argument> args_;
  std::vector<Parameter> parameters_, outputs_;  // null for scalars
  std::vector<std::string> names_;               // names of arguments, then outputs
  Callable callable_;
  std::shared_ptr<PresumedStrides> strides_;
  bool are_strides_wrong_ = false;  // for some array of the last call
  size_t lifted_ = 0;               // count_lifted() at the last compilation
  int64_t short_elements_ = -1;     // largest number of elements whose call was short
  bool counts_ = false;             // whether an argument is a whole number
};

// A call on tensors of known element types and sizes, in a single Python call, because each further Python call would
// take longer than the computation. Immutable, so threads may share it.
class ExpectedCall {
 public:
  // `callable`: a Bound; `inputs`: pairs of element type and sizes; `makers`: functions that each create a result.
  ExpectedCall(py::object callable, const py::iterable& inputs, const py::iterable& makers)
      : callable_(std::move(callable)), bound_(callable_.cast<Bound*>()) {
    for (py::handle one : inputs) {
      const auto pair = one.cast<std::pair<py::object, py::tuple>>();
      inputs_.push_back({pair.first, pair.second});
    }
    for (py::handle one : makers) makers_.push_back(py::reinterpret_borrow<py::object>(one));
  }

  // The results. Returns None, without side effects, if the tensors have other types or sizes.
  py::object call(const py::tuple& arguments) const {
    if (arguments.size() != inputs_.size()) return py::none();
    for (size_t i = 0; i < inputs_.size(); i++) {
      if (!is_of(arguments[i], inputs_[i])) return py::none();
    }
    py::list results(makers_.size());
    py::tuple all(arguments.size() + makers_.size());
    for (size_t i = 0; i < arguments.size(); i++) all[i] = arguments[i];
    for (size_t i = 0; i < makers_.size(); i++) {
      PyObject* const result = PyObject_CallNoArgs(makers_[i].ptr());
      if (!result) throw py::error_already_set();
      results[i] = py::reinterpret_steal<py::object>(result);
      all[arguments.size() + i] = results[i];
    }
    bound_->call_tensors(all);
    return results;
  }

 private:
  py::object callable_;
  Bound* bound_;
  std::vector<TensorKind> inputs_;
  std::vector<py::object> makers_;
};

Parameter parameter_of(py::handle object) {
  if (py::isinstance<OutputImageParam>(object))
    return object.cast<const OutputImageParam&>().parameter();
  if (py::isinstance<Buffer<>>(object)) return object.cast<const Buffer<>&>().parameter();
  return nullptr;
}

template <class Self>
void bind_compile(Class<Self> c) {
  c.def(
      "compile_to_callable",
      [](const py::object& object, const py::iterable& arguments,
         const std::optional<Target>& target) {
        const Pinned<Self> self(object);
        std::vector<Argument> args;
        std::vector<Parameter> parameters, outputs;
        std::vector<std::string> output_names;
        for (py::handle one : arguments) {
          args.push_back(one.cast<Argument>());
          parameters.push_back(parameter_of(one));
        }
        for (const Func& f : outputs_of(*self.self)) {
          for (const OutputImageParam& output : f.output_buffers()) {
            outputs.push_back(output.parameter());
            output_names.push_back(output.name());
          }
        }
        const Target to = target ? *target : get_jit_target_from_environment();
        return std::make_unique<Bound>([=] { return self->compile_to_callable(args, to); }, args,
                                       parameters, outputs, output_names);
      },
      arg("arguments"), arg("target") = py::none());
}

}  // namespace

void bind_callable(py::module_& m) {
  Class<Bound>(m, "Callable")
      .def("__call__", &Bound::call)
      .def("_call_tensors", &Bound::call_tensors)
      .def("_call_tensors_on_device", &Bound::call_tensors_on_device)
      .def("defined", [](const Bound&) { return true; });
  py::class_<ExpectedCall>(m, "_ExpectedCall")
      .def(py::init<py::object, const py::iterable&, const py::iterable&>())
      .def("__call__", &ExpectedCall::call);
  m.def("_use_huge_pages", &use_huge_pages);
  bind_compile(reopened<Func>(m, "Func", {"Runnable"}));
  bind_compile(reopened<Pipeline>(m, "Pipeline", {"Runnable"}));
}

}  // namespace retrograde::python
