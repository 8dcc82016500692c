#include "jit/extern_pipelines.h"

#include <algorithm>
#include <functional>
#include <tuple>

#include "diagnostics/error.h"
#include "graph/definitions/parameter_contents.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::jit {
namespace {

using ir::LoweredArgument;

const graph::ParameterContents* parameter_of(const LoweredArgument& arg) {
  return dynamic_cast<const graph::ParameterContents*>(arg.symbol.lock().get());
}

bool is_literal(const LoweredArgument& arg) {
  const auto* parameter = parameter_of(arg);
  return parameter && parameter->is_literal;
}

class CallRewriter : public ir::Rewriter {
 public:
  explicit CallRewriter(const ExternPipelines& pipelines) : pipelines_(pipelines) {}

 protected:
  Expr rewrite(const Expr& e) override {
    const Expr inside = children(e);
    const ir::Call* call = inside.as<ir::Call>();
    if (!call || call->call_type != ir::CallType::Extern) return inside;
    const auto found = pipelines_.find(call->name);
    return found == pipelines_.end() ? inside : with_context(*call, found->second);
  }

 private:
  const ExternPipelines& pipelines_;

  static Expr user_context() {
    return ir::call_op(ir::Op::runtime_call, Handle(), {Expr("retrograde_user_context")});
  }

  static Expr address_of(const graph::ParameterContents& literal) {
    return ir::reinterpret_as(
        Handle(), ir::make_uint_const(UInt(64), reinterpret_cast<uint64_t>(literal.buffer)));
  }

  // The caller's arguments are all of the pipeline's arguments except literal Buffers. They may leave out the user
  // context.
  static Expr with_context(const ir::Call& call, const ExternPipeline& pipeline) {
    const size_t taken =
        static_cast<size_t>(std::ranges::count_if(pipeline.arguments, std::not_fn(is_literal)));
    std::vector<Expr> given = call.args;
    if (given.size() + 1 == taken) given.insert(given.begin(), user_context());
    std::vector<Expr> args = {Expr(call.name)};
    size_t next = 0;
    for (const LoweredArgument& arg : pipeline.arguments) {
      if (is_literal(arg)) {
        args.push_back(address_of(*parameter_of(arg)));
        continue;
      }
      if (next == given.size() || !fits(given[next], arg)) refuse(call, pipeline);
      args.push_back(given[next++]);
    }
    if (next < given.size()) refuse(call, pipeline);
    return ir::call_op(ir::Op::runtime_call, call.type, std::move(args));
  }

  static bool fits(const Expr& given, const LoweredArgument& arg) {
    return given.type() == (arg.is_buffer() ? Handle() : arg.type);
  }

  [[noreturn]] static void refuse(const ir::Call& call, const ExternPipeline& pipeline) {
    const auto described = [](const LoweredArgument& arg) {
      return text(quoted(arg.name),
                  arg.is_buffer() ? " (buffer)" : " (" + to_string(arg.type) + ")");
    };
    std::vector<std::string> taken;
    for (const LoweredArgument& arg : pipeline.arguments) {
      if (!is_literal(arg)) taken.push_back(described(arg));
    }
    const std::string given =
        listed(call.args, [](const Expr& arg) { return to_string(arg.type()); });
    user_error(
        "call the pipeline " + quoted(call.name), "a call of a pipeline passes all its arguments",
        text("it takes ", listed(taken), " and was given ", given, ", where a handle is a buffer"),
        "Give images and Params in the order of their names");
  }
};

}  // namespace

ExternPipeline compile_with_pipelines(ir::LoweredFunction function, ExternPipelines called,
                                      const std::map<std::string, void*>& externs,
                                      const Target& target) {
  if (!called.empty()) function.body = CallRewriter(called)(function.body);
  Options options;
  options.externs = externs;
  for (const auto& [name, one] : called) options.externs[name] = one.code->address();
  ExternPipeline result;
  result.code = compile(function, target, options);
  result.arguments = std::move(function.args);
  result.called = std::move(called);
  return result;
}

// Sorts images first, then Params, then literal Buffers, each by name.
std::vector<LoweredArgument> in_order_of_calls(std::vector<LoweredArgument> args) {
  const auto key = [](const LoweredArgument& arg) {
    return std::make_tuple(is_literal(arg), !arg.is_buffer(), arg.name);
  };
  std::ranges::sort(args, {}, key);
  LoweredArgument user_context{"__user_context", LoweredArgument::Kind::Scalar, Handle(), 0, {}};
  args.insert(args.begin(), std::move(user_context));
  return args;
}

}  // namespace retrograde::jit
