// Builders of calls: of operators, which fold, and of functions, Funcs and images.
#include <algorithm>

#include "ir/build.h"
#include "ir/fold.h"
#include "ir/operators.h"

namespace retrograde::ir {

namespace {

// Scalar arguments of a vector operator are broadcast.
Type match_argument_lanes(Type type, std::vector<Expr>& args) {
  int lanes = type.lanes();
  for (const Expr& arg : args) lanes = std::max(lanes, arg.type().lanes());
  for (Expr& arg : args) {
    if (lanes > 1 && arg.type().is_scalar()) arg = make_broadcast(std::move(arg), lanes);
    RETROGRADE_ASSERT(arg.type().lanes() == lanes, "operator arguments of ", arg.type().lanes(),
                      " and ", lanes, " lanes");
  }
  return type.with_lanes(lanes);
}

}  // namespace

Expr call_op(Op op, Type type, std::vector<Expr> args) {
  const OpInfo& info = op_info(op);
  RETROGRADE_ASSERT(info.arity < 0 || info.arity == static_cast<int>(args.size()), info.name,
                    " of ", args.size(), " arguments");
  if (info.cls == OpClass::Pure || info.cls == OpClass::Marker)
    type = match_argument_lanes(type, args);
  if (info.cls == OpClass::Pure) {
    if (Expr folded = fold_operator(op, type, args); folded.defined()) return folded;
  }
  return make_node<Call>(type, CallType::Operator, op, info.name, std::move(args), 0, SymbolRef());
}

Expr call_op(Op op, std::vector<Expr> args) {
  RETROGRADE_ASSERT(!args.empty(), op_info(op).name, " of no arguments needs a type");
  const Type type = args[0].type();
  return call_op(op, type, std::move(args));
}

Expr call_extern(const std::string& name, Type type, std::vector<Expr> args, bool is_pure) {
  return make_node<Call>(type, CallType::Extern, Op::none, name, std::move(args),
                         is_pure ? Call::pure_extern : 0, SymbolRef());
}

Expr call_func(const std::string& name, Type type, std::vector<Expr> args, int component,
               SymbolRef symbol) {
  return make_node<Call>(type, CallType::Func, Op::none, name, std::move(args), component,
                         std::move(symbol));
}

Expr call_image(const std::string& name, Type type, std::vector<Expr> args, SymbolRef symbol) {
  return make_node<Call>(type, CallType::Image, Op::none, name, std::move(args), 0,
                         std::move(symbol));
}

Expr likely(Expr e) {
  if (!e.defined()) {
    user_error("apply likely", "every operand must be a defined expression",
               "it was never assigned", "Assign the Expr before its use");
  }
  return call_op(Op::likely, {std::move(e)});
}

}  // namespace retrograde::ir
