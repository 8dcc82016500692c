#include "autodiff/sweeps/chosen_values.h"

#include <algorithm>
#include <optional>

#include "autodiff/sums/chosen_terms.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

constexpr int64_t most_alternatives = 8;
constexpr size_t most_chosen_values = 16;

// Whether the variable decides a choice and nothing else that gets an adjoint.
bool only_chooses(const StageValues& stage, const std::string& var,
                  FunctionRef<bool(const Expr&)> is_active) {
  bool chooses = false;
  for (const Expr& value : stage.values) {
    chooses |= chooses_by(value, var);
    const bool is_place = any_node(value, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      return call && call->call_type != CallType::Operator && uses_variable(e, var) && is_active(e);
    });
    if (is_place) return false;
  }
  return chooses;
}

std::optional<size_t> chosen_dimension(const StageValues& stage,
                                       FunctionRef<bool(const Expr&)> is_active) {
  for (size_t d = 0; d < stage.domain.vars.size() && stage.domain.vars.size() > 1; ++d) {
    const LoopVariable& v = stage.domain.vars[d];
    const auto extent = constant_extent(v.range());
    if (extent && *extent > 1 && *extent <= most_alternatives && as_const_int(simplify(v.min)) &&
        static_cast<size_t>(*extent) * stage.values.size() <= most_chosen_values &&
        only_chooses(stage, v.name, is_active))
      return d;
  }
  return std::nullopt;
}

StageValues written_out(const StageValues& stage, size_t dimension) {
  const LoopVariable v = stage.domain.vars[dimension];
  StageValues result;
  result.domain = stage.domain;
  result.domain.vars.erase(result.domain.vars.begin() + static_cast<std::ptrdiff_t>(dimension));
  for (int64_t i = 0; i < *constant_extent(v.range()); ++i) {
    const Expr at = simplify(v.min + static_cast<int>(i));
    for (const Expr& value : stage.values) result.values.push_back(chosen_term(value, v.name, at));
    for (const Expr& seed : stage.seeds)
      result.seeds.push_back(seed.defined() ? substitute(seed, v.name, at) : seed);
    for (const Expr& read : stage.reads) result.reads.push_back(substitute(read, v.name, at));
  }
  return result;
}

}  // namespace

StageValues with_choices_as_values(StageValues stage, FunctionRef<bool(const Expr&)> is_active) {
  if (stage.domain.predicate.defined()) return stage;
  while (const auto dimension = chosen_dimension(stage, is_active))
    stage = written_out(stage, *dimension);
  return stage;
}

}  // namespace retrograde::autodiff
