// What may be kept of values that updates overwrite and partials need
// (AdjointOptions::overwritten).
//
// One budget for a whole program: what its updates keep counts together. Where sizes are known at
// run time only, so are the bytes: then a check stands before the copy, in a Func of its own that
// fails beyond the budget, and memory that was reserved by then is never touched.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "autodiff/report/explain.h"
#include "graph/function.h"

namespace retrograde::autodiff {

inline constexpr int64_t default_version_bytes = int64_t{256} << 20;

struct VersionRules {
  enum class Keep : uint8_t { Never, WithinBudget, Always };
  Keep keep = Keep::WithinBudget;
  int64_t bytes = default_version_bytes;
};

// A Func with versions of another one.
struct KeptVersions {
  FuncPtr copy;
  std::vector<Expr> extents;  // their product is the number of its elements; undefined: unknown
  std::string primal, asked;  // the Func it keeps, what was asked for: for messages
};

class VersionBudget {
 public:
  explicit VersionBudget(const VersionRules& rules) : rules_(rules) {}

  bool keeps_any() const { return rules_.keep != VersionRules::Keep::Never; }
  // Takes from the budget: throws UserError where more is known to be needed than there is, or
  // where nothing is known. May change the copy's pure definition, and gives the Func that checks,
  // or null.
  FuncPtr take(const KeptVersions& versions, std::vector<Explanation>& explanations);

 private:
  FuncPtr guard(const KeptVersions& versions, const Expr& bytes) const;
  [[noreturn]] void refuse(const KeptVersions& versions, const std::string& evidence) const;
  std::string rule() const;

  VersionRules rules_;
  Expr taken_;  // bytes; undefined: none
};

}  // namespace retrograde::autodiff
