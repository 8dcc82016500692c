#include "autoschedule/row_groups.h"

#include <algorithm>
#include <string>

#include "analysis/linear.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

// A loop that moves along rows: its iterations are `step` rows apart.
struct Digit {
  std::string variable;  // of the block
  int64_t step = 1;
  friend bool operator==(const Digit&, const Digit&) = default;
};
using Digits = std::vector<Digit>;  // of one coordinate of rows, lowest first

class GroupFinder {
 public:
  GroupFinder(const RowHost& host, const FuncPtr& sums, const FuncPtr& block,
              const std::vector<Expr>& place, const SizeEstimate& sizes)
      : host_(host), sums_(*sums), block_(*block), place_(place), sizes_(sizes) {
    result_.guest = {sums, block, {}};
  }

  std::optional<GuestOfGroups> find(const std::vector<std::vector<Expr>>& rows) {
    std::optional<std::vector<Digits>> found;
    for (const std::vector<Expr>& indices : rows) {
      std::vector<Digits> digits;
      for (const Expr& index : indices) {
        auto of = digits_of(index);
        if (!of) return std::nullopt;
        digits.push_back(std::move(*of));
      }
      if (found.value_or(digits) != digits) return std::nullopt;
      found = std::move(digits);
    }
    if (!found) return std::nullopt;
    for (size_t row = 0; row < found->size(); ++row) {
      const Interval range = sizes_.range(*host_.host, host_.rows[row].dimension);
      const bool starts_at_zero = range.is_bounded() && as_const_int(range.min) == 0;
      if (!starts_at_zero || host_.rows[row].divisor > 1 || !add_groups(row, (*found)[row]))
        return std::nullopt;
    }
    return shares_all_loops() ? std::optional(std::move(result_)) : std::nullopt;
  }

 private:
  const RowHost& host_;
  const FuncContents& sums_;
  const FuncContents& block_;
  const std::vector<Expr>& place_;
  const SizeEstimate& sizes_;
  GuestOfGroups result_;

  const ReductionVariable* term_loop(const std::string& variable) const {
    const auto& rvars = block_.updates[0].rvars;
    const auto found = std::ranges::find(rvars, variable, &ReductionVariable::var);
    return found == rvars.end() ? nullptr : &*found;
  }

  // The variable of the sums that is an argument of the block.
  std::string shared_loop(const std::string& argument) const {
    const auto arg = std::ranges::find(block_.args, argument);
    if (arg == block_.args.end()) return "";
    const auto* v = place_[static_cast<size_t>(arg - block_.args.begin())].as<Variable>();
    return v ? v->name : "";
  }

  std::optional<int64_t> values_of(const std::string& variable) const {
    if (const ReductionVariable* r = term_loop(variable)) return count_of(*r);
    const auto& rvars = sums_.updates[0].rvars;
    const auto r = std::ranges::find(rvars, shared_loop(variable), &ReductionVariable::var);
    if (r != rvars.end()) return count_of(*r);
    return std::nullopt;
  }
  static std::optional<int64_t> count_of(const ReductionVariable& r) {
    return as_const_int(r.min) == 0 ? as_const_int(simplify(r.extent)) : std::nullopt;
  }

  // Steps that each are all values of the digit below.
  std::optional<Digits> digits_of(const Expr& index) const {
    std::vector<std::string> variables = block_.args;
    for (const ReductionVariable& r : block_.updates[0].rvars) variables.push_back(r.var);
    const auto linear = analysis::decompose(index, variables);
    if (!linear || as_const_int(simplify(linear->rest)) != 0) return std::nullopt;
    Digits digits;
    for (const auto& [variable, step] : linear->coefficients) {
      if (step != 0) digits.push_back({variable, step});
    }
    std::ranges::sort(digits, {}, &Digit::step);
    int64_t step = 1;
    for (const Digit& digit : digits) {
      if (digit.step != step) return std::nullopt;
      const auto values = values_of(digit.variable);
      if (!values && &digit != &digits.back()) return std::nullopt;
      step *= values.value_or(1);
    }
    return digits.empty() ? std::nullopt : std::optional(std::move(digits));
  }

  // The digits of the block are below the others.
  bool add_groups(size_t row, const Digits& digits) {
    bool is_shared = false;
    for (const Digit& digit : digits) {
      if (term_loop(digit.variable)) {
        if (is_shared) return false;
        continue;
      }
      is_shared = true;
      const std::string loop = shared_loop(digit.variable);
      if (loop.empty() || std::ranges::find(result_.guest.loops, loop) != result_.guest.loops.end())
        return false;
      result_.groups.push_back({row, digit.step});
      result_.guest.loops.push_back(loop);
    }
    return true;
  }

  // Loops that add up are serial, inside of those over parts, of which there are enough.
  bool shares_all_loops() {
    const auto& rvars = sums_.updates[0].rvars;
    const auto is_added_up = [&](const std::string& loop) {
      return std::ranges::find(rvars, loop, &ReductionVariable::var) != rvars.end();
    };
    const std::vector<std::string>& loops = result_.guest.loops;
    const size_t added = std::ranges::count_if(loops, is_added_up);
    if (added != rvars.size() || loops.size() == added) return false;
    if (!std::all_of(loops.begin(), loops.begin() + added, is_added_up)) return false;
    result_.parallel = loops.size() - added;
    int64_t parts = 1;
    for (size_t i = added; i < loops.size(); ++i) {
      const auto arg = std::ranges::find(sums_.args, loops[i]);
      if (arg == sums_.args.end()) return false;
      parts *= sizes_.extent(sums_, static_cast<size_t>(arg - sums_.args.begin())).value_or(1);
    }
    return parts >= sizes_.machine().enough_tasks();
  }
};

}  // namespace

std::optional<GuestOfGroups> guest_of_groups(const RowHost& host, const FuncPtr& sums,
                                             const FuncPtr& block, const std::vector<Expr>& place,
                                             const std::vector<std::vector<Expr>>& rows,
                                             const SizeEstimate& sizes) {
  return GroupFinder(host, sums, block, place, sizes).find(rows);
}

int64_t rows_of_group(const RowHost& host, const std::vector<RowGroup>& groups,
                      const SizeEstimate& sizes) {
  int64_t rows = 1;
  for (size_t row = 0; row < host.rows.size(); ++row) {
    const auto lowest = std::ranges::find(groups, row, &RowGroup::row);
    rows *= lowest == groups.end() ? sizes.extent(*host.host, host.rows[row].dimension).value_or(1)
                                   : lowest->step;
  }
  return rows;
}

}  // namespace retrograde::autoschedule
