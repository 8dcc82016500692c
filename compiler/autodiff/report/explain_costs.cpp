#include "autodiff/report/explain_costs.h"

#include <algorithm>
#include <cstdio>

#include "diagnostics/error.h"
#include "graph/function.h"

namespace retrograde::autodiff {

namespace {

using What = Explanation::Kind;

std::string names_of(const std::vector<WantedFunc>& outputs) {
  std::string names;
  for (const WantedFunc& output : outputs) names += (names.empty() ? "" : ", ") + output.func->name;
  return names;
}

std::string counted(const Count& count, const char* what) {
  return count.text() + " " + what + (count.value() == 1.0 ? "" : "s");
}

const char* reason_to_store(const FuncContents& f) {
  if (f.schedule.compute_level.kind != graph::LoopLevel::Kind::Inlined) return "by its schedule";
  if (f.is_extern()) return "because a C function fills it";
  if (!f.is_pure()) return "because it has updates";
  return "because it is requested or read often";
}

Explanation stored(const FuncOperations& f) {
  std::string work =
      f.is_extern ? "operations of a C function" : counted(f.operations(), "operation");
  return {What::Stored, f.func->name,
          text(f.func->made ? "" : "the gradient reads its values; ", counted(f.bytes, "byte"),
               ", ", work, ", ", reason_to_store(*f.func)),
          f.bytes.value().value_or(0)};
}

// Whether it is a Func of the program that has updates and no directives.
bool is_stored_by_default(const FuncOperations& f) {
  return f.stored && !f.func->made && !f.func->is_pure() && !f.is_extern &&
         f.func->schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined;
}
Explanation computed_once(const FuncOperations& f) {
  return {What::Performance, f.func->name,
          "without a directive it is computed at root: inside the loops of its consumer its "
          "updates would run again for each element"};
}

Explanation recomputed(const FuncOperations& f) {
  Operations each;
  for (const StageOperations& s : f.stages) each += s.each;
  return {What::Recomputed, f.func->name,
          text(f.func->made ? "" : "the gradient reads its values; ", "at each of ",
               counted(f.evaluations, "read"), ", ", counted(each.total(), "operation"),
               " each time, no memory")};
}

Explanation totals(const std::string& outputs, const OperationCount& primal,
                   const OperationCount& gradient) {
  Count before = primal.operations(), after = gradient.operations();
  std::string ratio;
  if (before.value() && after.value() && *before.value() > 0) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.2f", *after.value() / *before.value());
    ratio = text(", ", digits, " times as many");
  }
  return {What::Cost, outputs,
          text(counted(before, "operation"), " and ", counted(primal.bytes(), "byte"),
               "; its gradient alone: ", counted(after, "operation"), ratio, ", and ",
               counted(gradient.bytes(), "byte"))};
}

// The bytes that `count` stores, without the requested results.
std::optional<double> kept_between(const OperationCount& count,
                                   const std::vector<WantedFunc>& results) {
  double bytes = 0;
  for (const FuncOperations& f : count.funcs) {
    const bool is_result =
        std::ranges::any_of(results, [&](const WantedFunc& w) { return w.func == f.func; });
    if (is_result || !f.stored) continue;
    if (!f.bytes.value()) return std::nullopt;
    bytes += *f.bytes.value();
  }
  return bytes;
}

// Adds a note if a gradient stores more than twice the intermediate results of the program, and names the largest.
void note_memory(const std::vector<WantedFunc>& outputs, const std::vector<WantedFunc>& gradients,
                 const OperationCount& primal, const OperationCount& gradient,
                 std::vector<Explanation>& result) {
  const auto own = kept_between(primal, outputs), more = kept_between(gradient, gradients);
  if (!own || !more || *more <= 2 * *own) return;
  const FuncOperations* largest = nullptr;
  for (const FuncOperations& f : gradient.funcs) {
    const bool is_result =
        std::ranges::any_of(gradients, [&](const WantedFunc& w) { return w.func == f.func; });
    if (is_result || !f.stored) continue;
    if (!largest || *f.bytes.value() > *largest->bytes.value()) largest = &f;
  }
  result.push_back(
      {What::Performance, names_of(outputs),
       text("its gradient stores ", Count(*more).text(),
            " bytes of intermediate results, the program ", Count(*own).text(),
            "; most of them in ", quoted(largest->func->name), ", ", largest->bytes.text(),
            ": compute it inside the loops of its consumer to store less")});
}

}  // namespace

std::vector<Explanation> explain_costs(const std::vector<WantedFunc>& outputs,
                                       const std::vector<WantedFunc>& gradients,
                                       const OperationCount& primal,
                                       const OperationCount& gradient) {
  std::vector<Explanation> result;
  for (const FuncOperations& f : gradient.funcs) {
    result.push_back(f.stored ? stored(f) : recomputed(f));
    if (is_stored_by_default(f)) result.push_back(computed_once(f));
  }
  for (const FuncOperations& f : primal.funcs) {
    if (f.func->made || gradient.find(f.func.get())) continue;
    result.push_back({What::LeftOut, f.func->name, "the gradient needs none of its values"});
  }
  result.push_back(totals(names_of(outputs), primal, gradient));
  note_memory(outputs, gradients, primal, gradient, result);
  return result;
}

}  // namespace retrograde::autodiff
