#include "autodiff/explain_costs.h"

#include <cstdio>

#include "autodiff/adjoint_contents.h"
#include "diagnostics/error.h"

namespace retrograde::ir {

namespace {

using What = Explanation::Kind;

bool is_made(const FuncContents& f) { return dynamic_cast<const AdjointContents*>(&f) != nullptr; }

std::string counted(const Count& count, const char* what) {
  return count.text() + " " + what + (count.value() == 1.0 ? "" : "s");
}

const char* reason_to_store(const FuncContents& f) {
  if (f.schedule.compute_level.kind != LoopLevel::Kind::Inlined) return "by its schedule";
  if (f.is_extern()) return "as a C function fills it";
  if (!f.is_pure()) return "as it has updates";
  return "as it is wanted itself or read often";
}

Explanation stored(const FuncOperations& f) {
  std::string work =
      f.is_extern ? "operations of a C function" : counted(f.operations(), "operation");
  return {What::Stored, f.func->name,
          text(is_made(*f.func) ? "" : "the gradient reads its values; ", counted(f.bytes, "byte"),
               ", ", work, ", ", reason_to_store(*f.func))};
}

Explanation recomputed(const FuncOperations& f) {
  Operations each;
  for (const StageOperations& s : f.stages) each += s.each;
  return {What::Recomputed, f.func->name,
          text(is_made(*f.func) ? "" : "the gradient reads its values; ", "in each of ",
               counted(f.evaluations, "read"), ", ", counted(each.total(), "operation"),
               " a time, no bytes")};
}

Explanation totals(const WantedFunc& output, const OperationCount& primal,
                   const OperationCount& gradient) {
  Count before = primal.operations(), after = gradient.operations();
  std::string ratio;
  if (before.value() && after.value() && *before.value() > 0) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.2f", *after.value() / *before.value());
    ratio = text(", ", digits, " times as many");
  }
  return {What::Cost, output.func->name,
          text(counted(before, "operation"), " and ", counted(primal.bytes(), "byte"),
               "; its gradient alone ", counted(after, "operation"), ratio, ", and ",
               counted(gradient.bytes(), "byte"))};
}

}  // namespace

std::vector<Explanation> explain_costs(const WantedFunc& output, const OperationCount& primal,
                                       const OperationCount& gradient) {
  std::vector<Explanation> result;
  for (const FuncOperations& f : gradient.funcs)
    result.push_back(f.stored ? stored(f) : recomputed(f));
  for (const FuncOperations& f : primal.funcs) {
    if (gradient.find(f.func.get())) continue;
    result.push_back({What::LeftOut, f.func->name, "the gradient needs none of its values"});
  }
  result.push_back(totals(output, primal, gradient));
  return result;
}

}  // namespace retrograde::ir
