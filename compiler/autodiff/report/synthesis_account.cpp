#include "autodiff/report/synthesis_account.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// ", 96 elements, 384 bytes when stored"; empty if the region is known at run time only.
std::string size_text(const FuncContents& f, const std::vector<LoopVariable>& region) {
  int64_t elements = 1;
  for (const LoopVariable& v : region) {
    auto extent = constant_extent(v.range());
    if (!extent) return "";
    elements *= std::max<int64_t>(*extent, 0);
  }
  return text(", ", elements, " elements, ", elements * total_bytes(f.types), " bytes when stored");
}

}  // namespace

void SynthesisAccount::add(Explanation::Kind kind, const std::string& subject,
                           const std::string& detail) {
  for (const Explanation& e : lines_) {
    if (e.kind == kind && e.subject == subject && e.detail == detail) return;
  }
  lines_.push_back({kind, subject, detail});
}

void SynthesisAccount::add(const std::vector<Explanation>& lines) { append(lines_, lines); }

void SynthesisAccount::built(const AdjointFunc& adjoint, const std::string& primal,
                             const std::vector<LoopVariable>& region) {
  const FuncContents& accumulating = adjoint.accumulator ? *adjoint.accumulator : *adjoint.func;
  auto stages = [&](Accumulation how) { return std::ranges::count(adjoint.stages, how); };
  const auto gathers = stages(Accumulation::Gather), scatters = stages(Accumulation::Scatter),
             privatised = stages(Accumulation::Privatised);
  add(Explanation::Kind::Built, primal,
      text(quoted(adjoint.func->name), ", ", gathers, " gathers over reduction domains, ", scatters,
           " scatters inside pure dimensions, ", privatised, " privatised sums",
           size_text(accumulating, region)));
  if (gathers + scatters + privatised > 0) {
    add(Explanation::Kind::Performance, primal,
        text("without a directive ", quoted(accumulating.name),
             " is computed at root, parallel over its outermost dimension and vectorized over its "
             "innermost"));
  }
  if (adjoint.accumulator) {
    add(Explanation::Kind::Built, primal,
        text(quoted(accumulating.name), " accumulates in double, and ", quoted(adjoint.func->name),
             " rounds the sum once, because an element may sum many terms"));
  }
  for (const std::string& note : adjoint.notes)
    add(Explanation::Kind::Performance, primal, text(quoted(adjoint.func->name), ": ", note));
  if (privatised > 0) {
    add(Explanation::Kind::Privatised, primal,
        "accumulated in a fixed number of privatised copies, which are summed in order");
  }
}

}  // namespace retrograde::autodiff
