#include "transform/step_variables.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <unordered_set>

#include "analysis/linear.h"
#include "graph/definitions/own_reads.h"
#include "graph/definitions/race_checks.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::transform {

namespace {

using Names = std::vector<std::string>;

constexpr size_t most_variables = 5;
constexpr size_t most_clamps = 5;  // of an access: with more, proofs take long and seldom succeed
constexpr int64_t least_row = 4;

Names joined(Names a, const Names& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::optional<int64_t> extent_of(const Definition& update, const std::string& variable) {
  const auto found = std::ranges::find(update.rvars, variable, &ReductionVariable::var);
  return as_const_int(simplify(found->extent));
}

bool is_along_row(const FuncContents& f, const Definition& update, const std::string& variable) {
  if (extent_of(update, variable).value_or(least_row) < least_row) return false;
  const auto moves = [&](const Expr& place) { return uses_variable(place, variable); };
  if (std::ranges::count_if(update.args, moves) != 1) return false;
  const auto& order = f.schedule.storage_dims;
  const auto innermost = order.empty() ? f.args.begin() : std::ranges::find(f.args, order.front());
  const auto row = static_cast<size_t>(innermost - f.args.begin());
  const auto form = decompose(update.args[row], {variable});
  return form && form->coefficients.size() == 1 && std::abs(form->coefficients[0].second) == 1;
}

class StepFinder {
 public:
  StepFinder(const FuncContents& f, const Definition& update)
      : f_(f), update_(update), variables_(mapped(update.rvars, &ReductionVariable::var)) {}

  // As few steps as possible, the outermost variables first; more only for the sake of vectors.
  StepVariables find() {
    const size_t count = variables_.size();
    if (count == 0 || count > most_variables || point_number(update_) ||
        clamps_of_an_access() > most_clamps)
      return {};
    for (const std::string& variable : variables_)
      is_apart_.push_back(graph::can_prove_race_free(f_, update_, variable));
    StepVariables best;
    for (int steps = 0; steps < static_cast<int>(count); ++steps) {
      for (unsigned bits = 1u << count; bits-- > 0;) {
        if (std::popcount(bits) != steps || has_apart(bits)) continue;
        StepVariables other = with_steps(bits);
        const bool is_no_better =
            other.along_row.empty() && (best.any_independent() || !other.any_independent());
        if (is_no_better) continue;
        if (graph::can_prove_same_order(f_, update_, variables_, other.order()))
          best = std::move(other);
        if (!best.along_row.empty()) return best;
      }
    }
    return best;
  }

 private:
  // The average number of minima and maxima in the coordinates of an access. A proof looks at the cases of each.
  size_t clamps_of_an_access() const {
    size_t clamps = 0;
    const auto count = [&](const std::vector<Expr>& coordinates) {
      for (const Expr& e : coordinates) {
        walk(e, [&](const Expr& part) {
          clamps += part.kind() == Kind::Min || part.kind() == Kind::Max;
          return true;
        });
      }
    };
    const std::vector<Expr> reads = graph::own_reads(f_, update_);
    count(update_.args);
    for (const Expr& read : reads) count(read.as<Call>()->args);
    return clamps / (reads.size() + 1);
  }

  bool has_apart(unsigned bits) const {
    for (size_t i = 0; i < is_apart_.size(); ++i) {
      if ((bits >> i & 1u) && is_apart_[i]) return true;
    }
    return false;
  }

  // The variables of the subset `bits` are steps.
  StepVariables with_steps(unsigned bits) const {
    StepVariables result;
    std::unordered_set<std::string> around;
    Names others;
    for (size_t i = 0; i < variables_.size(); ++i) {
      const bool is_step = bits >> i & 1u;
      (is_apart_[i] ? result.apart : is_step ? result.steps : others).push_back(variables_[i]);
      if (is_apart_[i] || is_step) around.insert(variables_[i]);
    }
    for (const std::string& variable : others) {
      const bool is_point = bits != 0 && graph::can_prove_race_free(f_, update_, variable, around);
      (is_point ? result.points : result.inside).push_back(variable);
    }
    for (Names* names : {&result.apart, &result.points}) {
      if (result.along_row.empty()) result.along_row = row_moved_first(*names);
    }
    return result;
  }

  std::string row_moved_first(Names& names) const {
    const auto found = std::ranges::find_if(
        names, [&](const std::string& name) { return is_along_row(f_, update_, name); });
    if (found == names.end()) return "";
    std::rotate(names.begin(), found, found + 1);
    return names.front();
  }

  const FuncContents& f_;
  const Definition& update_;
  const Names variables_;
  std::vector<bool> is_apart_;
};

}  // namespace

Names StepVariables::order() const { return joined(joined(inside, points), joined(steps, apart)); }

StepVariables step_variables(const FuncContents& f, const Definition& update) {
  return StepFinder(f, update).find();
}

}  // namespace retrograde::transform
