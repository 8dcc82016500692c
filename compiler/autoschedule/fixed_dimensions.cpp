#include "autoschedule/fixed_dimensions.h"

#include <algorithm>

#include "autoschedule/only_reader.h"
#include "autoschedule/size_estimate.h"
#include "graph/definitions/own_reads.h"
#include "graph/definitions/parameter_contents.h"
#include "ir/build.h"
#include "ir/lets.h"

namespace retrograde::autoschedule {

namespace {

const Bound* bound_of(const FuncContents& f, size_t d) {
  const auto& bounds = f.schedule.bounds;
  const auto found = std::find_if(bounds.begin(), bounds.end(),
                                  [&](const Bound& bound) { return bound.var == f.args[d]; });
  return found == bounds.end() ? nullptr : &*found;
}

// By its user.
Interval promised(const Bound& bound) {
  const bool is_whole = bound.min.defined() && bound.extent.defined() && !bound.modulus.defined();
  return is_whole ? constant_ends({bound.min, bound.min + bound.extent - 1}) : Interval();
}

// By the constraints on the buffer that an output fills, which every call checks.
Interval promised_of_buffer(const FuncContents& f, size_t d) {
  if (f.outputs.empty() || d >= f.outputs[0]->constraints.size()) return {};
  const BufferConstraint& c = f.outputs[0]->constraints[d];
  if (!c.min.defined() || !c.extent.defined()) return {};
  return constant_ends({c.min, c.min + c.extent - 1});
}

// A user's splits may compute more than is asked for, and so do updates that go elsewhere.
bool is_computed_as_asked(const FuncContents& f, size_t d) {
  for (int s = 0; s < f.stage_count(); ++s) {
    const Definition& stage = f.stage(s);
    if (is_split(stage, f.args[d]) || !is_pure_position(f, stage, d) ||
        (s > 0 && read_elsewhere(f, stage).defined()))
      return false;
  }
  return true;
}

// Of the loops of a stage; all values where sizes or data decide.
Scope<Interval> fixed_loops(const FuncContents& f, const Definition& stage, const Box& box) {
  Scope<Interval> scope;
  for (size_t d = 0; d < f.args.size(); ++d) {
    const bool is_known = is_pure_position(f, stage, d) && is_computed_as_asked(f, d);
    scope.push(f.args[d], is_known ? box[d] : Interval());
  }
  for (const ReductionVariable& r : stage.rvars) {
    const bool is_known = !is_split(stage, r.var);
    scope.push(r.var, is_known ? constant_ends({r.min, r.min + r.extent - 1}) : Interval());
  }
  return scope;
}

}  // namespace

FixedDimensions::FixedDimensions(const std::vector<FuncPtr>& outputs) {
  const std::vector<FuncPtr> order = topological_order(outputs);
  for (const FuncPtr& output : outputs) {
    Box& box = boxes_[output.get()];
    box.resize(output->args.size());
    for (size_t d = 0; d < box.size(); ++d) box[d] = promised_of_buffer(*output, d);
  }
  for (auto f = order.rbegin(); f != order.rend(); ++f) {  // readers first
    Box& box = boxes_[f->get()];
    box.resize((*f)->args.size());
    for (size_t d = 0; d < box.size(); ++d) {
      if (const Bound* bound = bound_of(**f, d))
        box[d] = promised(*bound);
      else if (!box[d].is_bounded() || !is_computed_as_asked(**f, d))
        box[d] = Interval();
    }
    note_reads(*f);
  }
}

void FixedDimensions::note_reads(const FuncPtr& f) {
  if (f->is_extern()) {
    for (const FuncPtr& callee : direct_callees(*f))
      boxes_[callee.get()] = Box(callee->args.size());
  }
  const Box box = boxes_.at(f.get());
  for (int s = 0; s < f->stage_count(); ++s) {
    const Scope<Interval> scope = fixed_loops(*f, f->stage(s), box);
    for_each_expr(f->stage(s), [&](const Expr& e) {
      for (const auto& [name, read] : footprints(without_lets(e), scope)) {
        if (read.is_image || read.symbol.raw() == f.get()) continue;
        Box ends = read.box;
        for (Interval& i : ends) i = constant_ends(i);
        Box& callee = boxes_[read.symbol.raw()];
        callee = hull(callee, ends);
      }
    });
  }
}

std::optional<FixedRange> FixedDimensions::of(const FuncContents& f, size_t dimension) const {
  const auto found = boxes_.find(&f);
  if (found == boxes_.end() || !found->second[dimension].is_bounded()) return std::nullopt;
  const Interval& i = found->second[dimension];
  const int64_t min = *as_const_int(i.min);
  return FixedRange{min, *as_const_int(i.max) - min + 1};
}

}  // namespace retrograde::autoschedule
