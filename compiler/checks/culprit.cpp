#include "checks/culprit.h"

#include <cmath>
#include <optional>

#include "autodiff/sweeps/local_derivative.h"
#include "autodiff/updates/update_context.h"
#include "checks/arrays.h"
#include "ir/build.h"
#include "ir/print.h"
#include "simplify/simplify.h"

namespace retrograde::checks {

namespace {

constexpr size_t most_operations = 400, most_evaluations = 2'000'000;

// Floating-point nodes that do not read f itself, operands first. Both arms of a select are included, since both are
// evaluated.
std::vector<Expr> operations_of(const Expr& value, const FuncContents& f) {
  return ir::filtered(autodiff::post_order({ir::without_lets(value)}), [&](const Expr& e) {
    return e.type().is_float() && !e.as<ir::FloatImm>() && !ir::calls(e, &f);
  });
}

// One definition of f at one element, with all iterations of its reduction.
struct Run {
  std::vector<Expr> operations;
  Shape shape;  // the operations, then the reduction variables, innermost first
  ir::Substitution place;
};

// nullopt if there are very many iterations, if the loops have no constant bounds, or if the coordinates of the update
// are not plain variables.
std::optional<Run> run_of(const FuncContents& f, int stage, int value, const std::vector<int>& at) {
  const Definition& d = f.stage(stage);
  Run run{operations_of(d.values[static_cast<size_t>(value)], f), {{0}, {}}, {}};
  run.shape.extents.push_back(static_cast<int>(run.operations.size()));
  if (run.operations.size() > most_operations) return std::nullopt;
  for (size_t k = 0; k < at.size(); ++k) {
    const auto* v = d.args[k].as<ir::Variable>();
    if (stage > 0 && !(v && v->name == f.args[k])) return std::nullopt;
    run.place[f.args[k]] = Expr(at[k]);
  }
  for (const ReductionVariable& r : d.rvars) {
    auto min = ir::as_const_int(simplification::simplify(r.min)),
         n = ir::as_const_int(simplification::simplify(r.extent));
    if (!min || !n || *n < 1) return std::nullopt;
    run.shape.mins.push_back(static_cast<int>(*min));
    run.shape.extents.push_back(static_cast<int>(*n));
  }
  if (count(run.shape) > most_evaluations) return std::nullopt;
  return run;
}

// A Func whose value at (i, iteration) is the result of operation i.
Func probe(const Definition& d, const Run& run) {
  Var i("i");
  std::vector<Var> args{i};
  ir::Substitution here = run.place;
  for (const ReductionVariable& r : d.rvars) {
    args.emplace_back("r" + std::to_string(args.size()));
    here[r.var] = args.back();
  }
  Expr all = 0.0;
  for (size_t n = run.operations.size(); n-- > 0;) {
    Expr value = ir::cast_to(Float(64), ir::substitute(run.operations[n], here));
    all = select(i == static_cast<int>(n), value, all);
  }
  if (d.predicate.defined())
    all = select(ir::substitute(ir::without_lets(d.predicate), here), all, 0.0);
  Func result("operations");
  result(args) = all;
  return result;
}

std::string described(const Expr& e, const ir::Substitution& place) {
  const ir::Call* call = e.as<ir::Call>();
  if (!call || call->call_type != ir::CallType::Image) return text(e);
  return text(simplification::simplify(ir::substitute(e, place)), ", an input");
}

// " in update 0 at r = 3"; empty for the pure definition.
std::string where(const Definition& d, int stage, const std::vector<int>& at) {
  if (stage == 0) return "";
  std::string result = text(", in update ", stage - 1);
  for (size_t k = 0; k < d.rvars.size(); ++k)
    result += text(k == 0 ? " at " : ", ", d.rvars[k].var, " = ", at[k + 1]);
  return result;
}

// The culprit in one definition. Empty if all values are finite, nullopt if the definition cannot be examined.
std::optional<std::string> culprit_in(const FuncContents& f, int stage, int value,
                                      const std::vector<int>& at) {
  auto run = run_of(f, stage, value, at);
  if (!run) return std::nullopt;
  if (run->operations.empty()) return "";
  const Definition& d = f.stage(stage);
  Func looked_at = probe(d, *run);
  const Values values = realize(looked_at, run->shape);
  for (size_t n = 0; n < values.size(); ++n) {
    if (std::isfinite(values[n])) continue;
    const std::vector<int> point = place_of(n, run->shape);
    ir::Substitution place = run->place;
    for (size_t k = 0; k < d.rvars.size(); ++k) place[d.rvars[k].var] = Expr(point[k + 1]);
    return described(run->operations[static_cast<size_t>(point[0])], place) +
           where(d, stage, point);
  }
  return "";
}

}  // namespace

std::string culprit(const Func& f, int value, const std::vector<int>& at) {
  const FuncContents& contents = *f.function();
  if (contents.is_extern()) return "";
  bool all_seen = true;
  for (int s = 0; s < contents.stage_count(); ++s) {
    const auto found = culprit_in(contents, s, value, at);
    if (found && !found->empty()) return *found;
    all_seen &= found.has_value();
  }
  if (contents.is_pure()) return "";
  return all_seen ? "what its updates make of finite values" : "an update";
}

}  // namespace retrograde::checks
