#include "autodiff/sums/contributions.h"

#include <algorithm>
#include <utility>

#include "autodiff/sweeps/input_shape.h"
#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::autodiff {

void Contributions::add_pointwise(const Symbol* symbol, const std::vector<std::string>& args,
                                  const Box& box, const std::vector<LoopVariable>& read,
                                  const std::vector<Expr>& values) {
  passed_.close(symbol);
  AccessQuery query{{}, {}, args, read};
  for (size_t d = 0; d < args.size(); ++d)
    query.domain.vars.push_back({args[d], box[d].min, box[d].max});
  query.indices = variables_of(args);
  Inversion inversion = invert_access(query);
  for (size_t k = 0; k < values.size(); ++k) {
    if (!values[k].defined()) continue;
    for (const Gather& g : inversion.gathers)
      pending_[symbol].push_back({static_cast<int>(k), g, substitute(values[k], g.iteration)});
  }
}

void Contributions::add(const FuncPtr& f, const LeafAdjoint& leaf, const Expr& adjoint,
                        const IterationDomain& domain) {
  const Symbol* symbol = symbol_of(leaf.leaf);
  const auto* call = leaf.leaf.as<Call>();
  const auto* read = dynamic_cast<const FuncContents*>(symbol);
  if (read && !has_size(*read)) {
    add_to_what_it_reads(*read, f, {leaf.leaf, adjoint}, domain);
    return;
  }
  const auto& [inversion, own_adjoint] = inverted(*f, leaf, domain);
  const Expr& contribution = adjoint.get() == leaf.adjoint.get() ? own_adjoint : adjoint;
  if (read && is_look_up(*read) && !primal_.is_named(symbol))
    passed_.note(symbol, {f, {leaf.leaf, adjoint}, domain});
  if (!inversion.note.empty())
    account_.add(Explanation::Kind::Scattered, shape_of(symbol).name,
                 text("read by ", quoted(f->name), ": ", inversion.note));
  for (const Gather& g : inversion.gathers)
    pending_[symbol].push_back(
        {call ? call->component : 0, g, substitute(contribution, g.iteration)});
}

// False only for Funcs whose consumers can contribute to what they read.
bool Contributions::has_size(const FuncContents& f) const {
  if (!f.is_pure() || f.is_extern() || f.custom_derivatives || primal_.is_named(&f)) return true;
  return std::ranges::all_of(primal_.regions.of(&f), &Interval::is_bounded);
}

void Contributions::add_to_what_it_reads(const FuncContents& read, const FuncPtr& f,
                                         const LeafAdjoint& leaf, const IterationDomain& domain) {
  if (without_adjoint_.insert(&read).second)
    account_.add(
        Explanation::Kind::NotRequested, read.name,
        "it is read at indices that depend on data and have no bounds, so its adjoint has "
        "no size: its consumers contribute to what it reads; clamp the indices to give it one");
  const SweepResult sweep =
      primal_.sweep({value_of_read(read, *leaf.leaf.as<Call>())}, {leaf.adjoint});
  for (const LeafAdjoint& further : sweep.leaves) add(f, further, domain);
}

bool Contributions::pass_on(const FuncContents& f) {
  std::vector<PassedRead> further;
  for (const PassedRead& read : passed_.of(&f)) {
    const SweepResult sweep =
        primal_.sweep({value_of_read(f, *read.read.leaf.as<Call>())}, {read.read.adjoint});
    for (const LeafAdjoint& leaf : sweep.leaves) {
      const Inversion& passed = inverted(*read.reader, leaf, read.domain).inversion;
      if (!is_short(passed) &&
          !sums_no_more(passed, leaf, inverted(*read.reader, read.read, read.domain).inversion))
        return false;
      further.push_back({read.reader, leaf, read.domain});
    }
  }
  for (const PassedRead& read : further) add(read.reader, read.read, read.domain);
  return !further.empty();
}

std::vector<Contribution> Contributions::take(const Symbol* symbol) {
  return std::exchange(pending_[symbol], {});
}

InvertedRead Contributions::inverted(const FuncContents& reader, const LeafAdjoint& leaf,
                                     const IterationDomain& domain) {
  const Symbol* symbol = symbol_of(leaf.leaf);
  const auto* call = leaf.leaf.as<Call>();
  const AdjointTarget target = primal_.target_of(symbol);
  AccessQuery query{domain, call ? call->args : std::vector<Expr>{}, target.args, target.region};
  return inversions_.of(reader, *symbol, query, leaf.adjoint);
}

}  // namespace retrograde::autodiff
