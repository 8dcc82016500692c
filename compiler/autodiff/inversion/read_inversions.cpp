#include "autodiff/inversion/read_inversions.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/memory_reads.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

namespace {

bool chooses(const Expr& index) {
  return any_node(index,
                  [&](const Expr& e) { return e.as<Min>() || e.as<Max>() || e.as<Select>(); });
}

// The condition under which the adjoint may be nonzero; undefined if unknown.
Expr where_it_counts(const Expr& adjoint) {
  const auto* selection = adjoint.as<Select>();
  if (!selection) return {};
  if (is_zero(selection->when_true)) return !selection->condition;
  return is_zero(selection->when_false) ? selection->condition : Expr();
}

// A key of all inputs of the inversion.
std::string text_of(const AccessQuery& query) {
  std::string text;
  const auto add = [&](const Expr& e) { text += (e.defined() ? ir::print(e) : "_") + ","; };
  const auto add_all = [&](const std::vector<LoopVariable>& vars) {
    for (const LoopVariable& v : vars) {
      text += v.name + (v.is_reduction ? ":" : "=");
      add(v.min);
      add(v.max);
    }
    text += ";";
  };
  add_all(query.domain.vars);
  add(query.domain.predicate);
  for (const Expr& index : query.indices) add(index);
  for (const std::string& arg : query.target_args) text += arg + ",";
  add_all(query.region);
  return text;
}

bool has_domains(const Inversion& inversion) {
  return std::ranges::any_of(inversion.gathers, [](const Gather& g) { return g.rdom != nullptr; });
}

}  // namespace

const Inversion& ReadInversions::of(const FuncContents& f, const Symbol& symbol,
                                    const AccessQuery& query, const Expr& adjoint) {
  const Inversion* selected = where_selected(f, symbol, query, adjoint);
  return selected ? *selected : find(f, symbol, query);
}

// Null if ignoring the unselected part does not help.
const Inversion* ReadInversions::where_selected(const FuncContents& f, const Symbol& symbol,
                                                AccessQuery query, const Expr& adjoint) {
  if (std::ranges::none_of(query.indices, chooses)) return nullptr;
  Expr counts = where_it_counts(adjoint);
  if (!counts.defined() || calls(counts, &f)) return nullptr;
  Expr& predicate = query.domain.predicate;
  predicate = predicate.defined() ? predicate && counts : counts;
  const Inversion& inversion = find(f, symbol, query);
  return inversion.note.empty() && inversion.gathers.size() == 1 ? &inversion : nullptr;
}

const Inversion& ReadInversions::find(const FuncContents& f, const Symbol& symbol,
                                      const AccessQuery& query) {
  std::string key = std::to_string(reinterpret_cast<uintptr_t>(&symbol));
  for (const Expr& e : query.indices) key += "," + ir::print(e);
  if (query.domain.predicate.defined()) key += "|" + ir::print(query.domain.predicate);
  for (const LoopVariable& v : query.domain.vars) key += ";" + v.name;
  key += f.name;
  auto [it, is_new] = found_.try_emplace(key);
  if (!is_new) return it->second;
  const std::string text = text_of(query);
  if (const auto known = without_domains_.find(text); known != without_domains_.end())
    return it->second = known->second;
  it->second = invert_or_scatter(query, operations_);
  if (!has_domains(it->second)) without_domains_[text] = it->second;
  if (it->second.gave_up) operations_ = std::max(operations_ / 2, least_operations);
  return it->second;
}

}  // namespace retrograde::autodiff
