#include "autodiff/updates/version_budget.h"

#include <algorithm>

#include "autodiff/sums/generated_definitions.h"
#include "diagnostics/error.h"
#include "frontend/language/expr_ops.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

constexpr const char* what_to_do =
    "Give the Func one more dimension that keeps the versions that are needed, raise "
    "AdjointOptions::version_bytes, run a loop over time backward from a few kept states "
    "(AdjointOptions::checkpoint_states), or keep the versions whatever they cost: "
    "AdjointOptions{.overwritten = Overwritten::Store}";

// The bytes as a double: it cannot overflow and is exact in the range that matters.
Expr bytes_of(const KeptVersions& versions) {
  Expr bytes = make_const(Float(64), static_cast<double>(total_bytes(versions.copy->types)));
  for (const Expr& any_extent : versions.extents) {
    if (!any_extent.defined()) return {};
    const Expr extent = simplify(any_extent);
    if (const auto known = as_const_int(extent)) {
      bytes = bytes * make_const(Float(64), static_cast<double>(std::max<int64_t>(*known, 0)));
    } else {
      bytes = bytes * cast_to(Float(64), max(extent, 0));
    }
  }
  return simplify(bytes);
}

std::string integer_text(double number) {
  return std::to_string(static_cast<int64_t>(std::min(number, 0x1p62)));
}

}  // namespace

FuncPtr VersionBudget::take(const KeptVersions& versions, std::vector<Explanation>& explanations) {
  if (rules_.keep == VersionRules::Keep::Always) return nullptr;
  const Expr own = bytes_of(versions);
  if (!own.defined())
    refuse(versions, text("the region of ", quoted(versions.primal), " has no bounds"));
  taken_ = simplify(taken_.defined() ? taken_ + own : own);
  const auto note = [&](const std::string& detail) {
    explanations.push_back({Explanation::Kind::Version, versions.primal, detail});
  };
  const std::string kept =
      text(quoted(versions.copy->name), " keeps versions within the budget of ", rules_.bytes,
           " bytes (AdjointOptions::version_bytes): ");
  if (const auto total = as_const_float(taken_)) {
    if (*total > static_cast<double>(rules_.bytes))
      refuse(versions, text("with those of ", quoted(versions.primal), " they are ",
                            integer_text(*total), " bytes"));
    note(kept + text(integer_text(as_const_float(own).value_or(0)), " bytes, all together ",
                     integer_text(*total)));
    return nullptr;
  }
  note(kept + "its size is known at run time only, when a call that needs more fails");
  return guard(versions, taken_);
}

// Builds the check: a scalar that is 0 or fails. The copy's pure definition reads it.
FuncPtr VersionBudget::guard(const KeptVersions& versions, const Expr& bytes) const {
  FuncPtr check = make_func(Role::VersionCheck, versions.copy->name + "_fits", versions.primal);
  const Expr fits = bytes <= make_const(Float(64), static_cast<double>(rules_.bytes));
  const std::string asked = text("cannot ", versions.asked, ": ", rule(), ", but with those of ",
                                 quoted(versions.primal), " they are");
  define_pure(check, {},
              {frontend::require_values(fits, {Expr(0), Expr(asked), cast_to(Int(64), bytes),
                                               Expr(text("bytes. ", what_to_do, "."))})});
  check->schedule.compute_level.kind = check->schedule.store_level.kind =
      graph::LoopLevel::Kind::Root;
  check->frozen = true;
  for (Expr& value : versions.copy->pure->values) {
    value = make_select(call_value(check, {}, 0) != 0, make_zero(value.type()), value);
  }
  versions.copy->version++;
  return check;
}

std::string VersionBudget::rule() const {
  return text(
      "values that updates overwrite and partial derivatives need are kept while all of them "
      "fit ",
      rules_.bytes, " bytes");
}

void VersionBudget::refuse(const KeptVersions& versions, const std::string& evidence) const {
  user_error(versions.asked, rule(), evidence, what_to_do);
}

}  // namespace retrograde::autodiff
