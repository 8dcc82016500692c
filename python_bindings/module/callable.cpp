// callable.cpp -- Callable: a compiled pipeline as a function of its arguments and outputs.
#include "frontend/run/callable.h"

#include "any_stride.h"
#include "bind_all.h"
#include "binding.h"
#include "buffer_memory.h"
#include "func_class.h"
#include "numbers.h"
#include "runnable.h"

namespace retrograde::frontend {

// Calls with as many arguments as a list has.
struct DynamicCall {
  using Value = Callable::Value;
  static Value value_of(const Buffer<>& buffer) { return Callable::value_of(buffer); }
  static Value value_of(const ir::Scalar& scalar) {
    return {nullptr, scalar, false, scalar.type, -1};
  }
  static void call(const Callable& callable, const std::vector<Value>& values) {
    callable.call(nullptr, values);
  }
};

}  // namespace retrograde::frontend

namespace retrograde::python {

namespace {

using frontend::DynamicCall;
using py::arg;
using Parameter = std::shared_ptr<graph::ParameterContents>;

// Compiled again where an array comes whose innermost axis is not dense (any_stride.h): once.
class Bound {
 public:
  using Compile = std::function<Callable()>;
  Bound(Compile compile, std::vector<Argument> args, std::vector<Parameter> parameters,
        std::vector<Parameter> outputs)
      : compile_(std::move(compile)),
        args_(std::move(args)),
        parameters_(std::move(parameters)),
        outputs_(std::move(outputs)) {
    callable_ = unlocked([compile = compile_](const Interruption&) { return compile(); });
  }

  void call(const py::args& given) {
    std::vector<Buffer<>> buffers(given.size());
    std::vector<DynamicCall::Value> values(given.size());
    bool lifted = false;
    for (size_t i = 0; i < given.size(); i++) {
      if (i < args_.size() && args_[i].is_scalar()) {
        values[i] = DynamicCall::value_of(scalar_of(args_[i].type, given[i]));
        continue;
      }
      buffers[i] = given[i].cast<Buffer<>>();
      if (i >= args_.size()) check_writable(buffers[i], "call a Callable");
      lifted |= lift(i, buffers[i]);
      values[i] = DynamicCall::value_of(buffers[i]);
    }
    if (lifted)
      callable_ = unlocked([compile = compile_](const Interruption&) { return compile(); });
    unlocked([callable = callable_, buffers, values](const Interruption&) {
      DynamicCall::call(callable, values);
    });
  }

 private:
  bool lift(size_t i, const Buffer<>& buffer) const {
    const size_t output = i - args_.size();
    const Parameter parameter = i < args_.size()           ? parameters_[i]
                                : output < outputs_.size() ? outputs_[output]
                                                           : nullptr;
    if (!parameter) return false;
    const auto before = parameter->version;
    allow_stride_of(*parameter, buffer);
    return parameter->version != before;
  }

  Compile compile_;
  std::vector<Argument> args_;
  std::vector<Parameter> parameters_, outputs_;  // null: of a scalar
  Callable callable_;
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
      [](const py::object& object, const py::iterable& given, const std::optional<Target>& target) {
        const Pinned<Self> self(object);
        std::vector<Argument> args;
        std::vector<Parameter> parameters, outputs;
        for (py::handle one : given) {
          args.push_back(one.cast<Argument>());
          parameters.push_back(parameter_of(one));
        }
        for (const Func& f : outputs_of(*self.self)) {
          for (const OutputImageParam& output : f.output_buffers())
            outputs.push_back(output.parameter());
        }
        const Target to = target ? *target : get_jit_target_from_environment();
        return std::make_unique<Bound>([=] { return self->compile_to_callable(args, to); }, args,
                                       parameters, outputs);
      },
      arg("arguments"), arg("target") = py::none());
}

}  // namespace

void bind_callable(py::module_& m) {
  Class<Bound>(m, "Callable").def("__call__", &Bound::call).def("defined", [](const Bound&) {
    return true;
  });
  bind_compile(reopened<Func>(m, "Func", {"Runnable"}));
  bind_compile(reopened<Pipeline>(m, "Pipeline", {"Runnable"}));
}

}  // namespace retrograde::python
