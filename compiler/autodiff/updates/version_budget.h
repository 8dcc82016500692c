// version_budget.h -- the memory budget for overwritten values that partials need (AdjointOptions::overwritten).
//
// All updates of a program share one budget. If sizes are known at run time only, so are the bytes. Then a Func of its
// own checks them before the copy and fails if they exceed the budget. Memory that is already reserved by then is never
// touched.
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

// A Func that holds versions of another one.
struct KeptVersions {
  FuncPtr copy;
  std::vector<Expr> extents;  // extents of the copy; undefined: unknown
  std::string primal, asked;  // for messages: the Func whose versions it holds, the user's request
};

class VersionBudget {
 public:
  explicit VersionBudget(const VersionRules& rules) : rules_(rules) {}

  bool keeps_any() const { return rules_.keep != VersionRules::Keep::Never; }
  // Takes the copy's memory from the budget. Throws UserError if it exceeds the budget, or if an extent is unknown. May
  // change the copy's pure definition, and returns the Func that checks at run time, or null.
  FuncPtr take(const KeptVersions& versions, std::vector<Explanation>& explanations);

 private:
  FuncPtr guard(const KeptVersions& versions, const Expr& bytes) const;
  [[noreturn]] void refuse(const KeptVersions& versions, const std::string& evidence) const;
  std::string rule() const;

  VersionRules rules_;
  Expr taken_;  // bytes taken so far; undefined: none
};

}  // namespace retrograde::autodiff
