#include "checks/culprit.h"

#include <cmath>

#include "autodiff/local_derivative.h"
#include "checks/arrays.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::checks {

namespace {

constexpr size_t most_operations = 400;

// Floating nodes, operands first; both arms of a selection are evaluated.
std::vector<Expr> operations_of(const Expr& value) {
  std::vector<Expr> result;
  for (const Expr& e : ir::post_order({ir::without_lets(value)})) {
    if (e.type().is_float() && !e.as<ir::FloatImm>()) result.push_back(e);
  }
  return result;
}

// The i-th of the operations at the place, all in one Func of one dimension.
Func probe(const ir::FuncContents& f, const std::vector<Expr>& operations,
           const std::vector<int>& at) {
  ir::Substitution place;
  for (size_t d = 0; d < at.size(); ++d) place[f.args[d]] = Expr(at[d]);
  Var i("i");
  Expr all = 0.0;
  for (size_t n = operations.size(); n-- > 0;) {
    Expr here = ir::cast_to(Float(64), ir::substitute(operations[n], place));
    all = select(i == static_cast<int>(n), here, all);
  }
  Func result("operations");
  result(i) = all;
  return result;
}

std::string described(const Expr& e, const std::vector<int>& at, const ir::FuncContents& f) {
  const ir::Call* call = e.as<ir::Call>();
  if (!call || call->call_type != ir::CallType::Image) return text(e);
  ir::Substitution place;
  for (size_t d = 0; d < at.size(); ++d) place[f.args[d]] = Expr(at[d]);
  return text(ir::substitute(e, place), ", an input");
}

}  // namespace

std::string culprit(const Func& f, int value, const std::vector<int>& at) {
  const ir::FuncContents& contents = *f.function();
  if (!contents.is_pure()) return "";
  const auto operations = operations_of(contents.pure->values[static_cast<size_t>(value)]);
  if (operations.empty() || operations.size() > most_operations) return "";
  const Values values =
      realize(probe(contents, operations, at), {{0}, {static_cast<int>(operations.size())}});
  for (size_t n = 0; n < values.size(); ++n) {
    if (!std::isfinite(values[n])) return described(operations[n], at, contents);
  }
  return "";
}

}  // namespace retrograde::checks
