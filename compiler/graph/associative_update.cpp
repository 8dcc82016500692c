#include "graph/associative_update.h"

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

// Why references of the update to f are not all to the point that it writes; empty when they are.
std::string other_reference(const FuncContents& f, const Definition& update) {
  std::string found;
  const auto is_self = [&](const Expr& e) {
    const Call* call = e.as<Call>();
    return call && call->call_type == CallType::Func && call->symbol.raw() == &f;
  };
  const auto at_point = [&](const Call& call) {
    for (size_t d = 0; d < update.args.size(); d++) {
      if (!equal(call.args[d], update.args[d])) return false;
    }
    return true;
  };
  const auto inspect = [&](const Expr& root, bool may_be_here) {
    if (!root.defined()) return;
    walk(root, [&](const Expr& e) {
      if (!found.empty()) return false;
      if (is_self(e) && !(may_be_here && at_point(*e.as<Call>())))
        found = text("it reads ", e, ", which is not the element that it writes");
      return found.empty();
    });
  };
  for (const Expr& arg : update.args) inspect(arg, false);
  inspect(update.predicate, false);
  for (const Expr& value : update.values) inspect(value, true);
  return found;
}

}  // namespace

AssociativityProof prove_associative(const FuncContents& f, const Definition& update) {
  AssociativityProof proof;
  proof.why_not = other_reference(f, update);
  if (!proof.why_not.empty()) return proof;
  std::vector<std::string> xs;
  for (size_t i = 0; i < update.values.size(); i++) xs.push_back(unique_name("x"));
  std::vector<Expr> values;
  for (const Expr& value : update.values) {
    values.push_back(
        rewrite(value, [&](const Expr& e, const std::function<Expr(const Expr&)>& recurse) {
          const Call* call = e.as<Call>();
          if (!call || call->call_type != CallType::Func || call->symbol.raw() != &f)
            return map_children(e, recurse);
          return variable(xs[call->component], call->type);
        }));
  }
  return prove_associative(values, xs);
}

}  // namespace retrograde::ir
