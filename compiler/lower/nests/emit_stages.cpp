// Emits the stages of a group: their regions, last nest first, and the loops of each nest, from the innermost body of
// every stage up to the place where the group is computed.
#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "diagnostics/error.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/checks/nest_checks.h"
#include "lower/nests/emit_definition.h"
#include "lower/nests/nest_emitter.h"
#include "lower/nests/shared_loops.h"
#include "lower/nests/specialize.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

void bind_reductions(const LoopedFunc& f, int s, Domain& domain, ComputePlace& site) {
  for (const ReductionVariable& r : f.stages[s].rvars) {
    Expr min = cast(Int(32), r.min), extent = cast(Int(32), r.extent);
    Interval range{min, simplify(min + extent - 1)};
    domain[r.var] = site.bind(stage_prefix(f.name(), s) + r.var, range);
  }
}

// Binds names to the region of a stage, and returns the region in terms of the names; `need` is updated likewise.
Domain bind_domain(const LoopedFunc& f, int s, Box& need, const std::vector<Slide>& slides,
                   ComputePlace& site) {
  Domain domain;
  const std::string prefix = stage_prefix(f.name(), s);
  for (size_t d = 0; d < need.size(); d++) {
    auto slide = std::ranges::find(slides, static_cast<int>(d), &Slide::dimension);
    const std::string& arg = f.func->args[d];
    domain[arg] = slide == slides.end() ? site.bind(prefix + arg, need[d])
                                        : site.bind_part(prefix + arg, *slide, need[d]);
  }
  bind_reductions(f, s, domain, site);
  return domain;
}

// The domain of a stage that shares loops with a later stage of its Func. Along dimensions in which that stage does not
// stay in place, as in a scan, it also computes what that stage reads.
Domain domain_of_earlier(const LoopedFunc& f, int s, int later_stage, const Domain& later,
                         const ValueBounds& values, ComputePlace& site) {
  Domain domain;
  const auto own = own_elements(f, later_stage, later, values);
  for (size_t d = 0; d < f.func->args.size(); d++) {
    const std::string& arg = f.func->args[d];
    const Range& range = later.at(arg);
    const bool stays = !own || is_pure_position(*f.func, f.stages[later_stage], d);
    domain[arg] = range;
    if (stays) continue;
    Interval all{range.min, simplify(range.min + range.extent - 1)};
    all = hull(all, (*own)[d]);
    domain[arg] = site.bind(stage_prefix(f.name(), s) + arg, all);
  }
  bind_reductions(f, s, domain, site);
  return domain;
}

}  // namespace

// Whether values that a Func's loops compute beyond its region along a dimension may overwrite values kept for later
// iterations. If the region stays the same during the lifetime of the storage, nothing beyond it is ever read.
bool NestEmitter::keeps_beside_its_region(const Member& member, size_t dimension,
                                          ComputePlace& site) {
  if (member.slides.empty()) return false;
  const Interval whole = site.whole(member.need)[dimension];
  const bool moves = std::ranges::any_of(member.loops, [&](const Loop& loop) {
    return uses_variable(whole.min, loop.name) || uses_variable(whole.max, loop.name);
  });
  return moves && runs_beyond_regions(*member.f, dimension);
}

bool NestEmitter::keeps_beside_its_regions(const Member& member, ComputePlace& site) {
  for (size_t d = 0; d < member.need.size(); d++) {
    if (keeps_beside_its_region(member, d, site)) return true;
  }
  return false;
}

// The points whose values may be read: those of the domain, extended to the range of the loops in dimensions in which
// values beside the region are kept. nullopt if unknown.
std::optional<Domain> NestEmitter::counted_points(const NestStage& stage, const Member& member,
                                                  ComputePlace& site) {
  Domain result = stage.domain;
  for (size_t d = 0; d < member.need.size(); d++) {
    if (!keeps_beside_its_region(member, d, site)) continue;
    if (!stage.f->stages[stage.stage].schedule.specializations.empty()) return {};
    const StageNest nest = build_stage_nest(*stage.f, stage.stage, stage.domain);
    Scope<Interval> loops;
    for (const Loop& loop : nest.loops) loops.push(loop.name, loop.range());
    const std::string& arg = stage.f->func->args[d];
    const Interval reached = bounds_of(nest.guarded_coordinate.at(arg), loops);
    if (!reached.is_bounded()) return {};
    result[arg] = {reached.min, simplify(reached.max - reached.min + 1)};
  }
  return result;
}

bool NestEmitter::is_one_of(const std::vector<NestStage>& stages, const std::string& func) {
  return std::ranges::any_of(stages,
                             [&](const NestStage& stage) { return stage.f->name() == func; });
}

Emitted NestEmitter::emit_members(const FusedGroup& group, std::vector<Member>& members,
                                  ComputePlace& site, std::vector<Stmt> stmts) {
  Emitted result;
  std::vector<Stmt> nests(group.nests.size());
  const auto member_of = [&](const FusedStage& stage) -> Member& {
    const auto it = std::find(group.funcs.begin(), group.funcs.end(), stage.func);
    return members[it - group.funcs.begin()];
  };
  for (size_t n = group.nests.size(); n-- > 0;) {
    // The last stage of a Func comes first: the part that slides also applies to earlier stages, and stages that share
    // its loops run over the same region, with the same names.
    const std::vector<FusedStage>& fused = group.nests[n].stages;
    std::vector<NestStage> stages(fused.size());
    std::map<int, std::pair<int, Domain>> bound;  // by Func: a stage and its domain
    for (size_t i = fused.size(); i-- > 0;) {
      Member& member = member_of(fused[i]);
      const bool is_last = fused[i].stage + 1 == static_cast<int>(member.f->stages.size());
      const auto same = bound.find(fused[i].func);
      Domain domain = same == bound.end()
                          ? bind_domain(*member.f, fused[i].stage, member.need,
                                        is_last ? member.slides : std::vector<Slide>(), site)
                          : domain_of_earlier(*member.f, fused[i].stage, same->second.first,
                                              same->second.second, values_, site);
      bound[fused[i].func] = {fused[i].stage, domain};
      stages[i] = {member.f, fused[i].stage, std::move(domain)};
    }
    Emitted code = stages[0].f->func->is_extern()
                       ? emit_extern(member_of(fused[0]), stages[0].domain, site)
                       : emit_variants(group.nests[n], stages, site);
    for (size_t i = 0; i < fused.size(); i++) {
      const auto counted = counted_points(stages[i], member_of(fused[i]), site);
      if (counted)
        stages[i].domain = *counted;
      else
        code.overrun.leaves_domain = false;
    }
    leave_overrun(stages, code);
    for (const FusedStage& stage : group.nests[n].stages)
      widen_by_own_reads(member_of(stage), code);
    nests[n] = code.stmt;
    merge_code(result, code);
  }
  stmts.insert(stmts.end(), nests.begin(), nests.end());
  result.stmt = make_block(std::move(stmts));
  for (Member& member : members) {
    Box box = simplified(member.need);
    if (member.f->is_output) box = hull(box, outputs_[member.f->name()]);
    result.storage[member.f->name()] = std::move(box);
  }
  return result;
}

// Computes the needs of a nest outside of its loops. Only points whose values matter count: their own reads, and the
// needs that follow for the Funcs computed in the loops. For reads beyond that, by loops that leave their domains,
// storage must exist, but the values do not matter.
void NestEmitter::leave_overrun(const std::vector<NestStage>& stages, Emitted& code) const {
  const Overrun& overrun = code.overrun;
  if (!std::exchange(code.overrun.leaves_domain, false) || overrun.counts) return;
  Requirements needed;
  for (const NestStage& stage : stages)
    merge_footprints(needed, read_inside(*stage.f, stage.domain, values_));
  for (const LoopedFunc* f : overrun.inside) {
    const auto use = needed.find(f->name());
    if (use == needed.end()) continue;
    Domain domain;
    for (size_t d = 0; d < use->second.box.size(); d++) {
      const Interval& side = use->second.box[d];
      if (!side.is_bounded()) return;
      domain[f->func->args[d]] = {side.min, simplify(side.max - side.min + 1)};
    }
    merge_footprints(needed, read_inside(*f, domain, values_));
  }
  for (auto& [name, use] : code.uses) {
    const auto inside = needed.find(name);
    if (use.is_image || inside == needed.end() || is_one_of(stages, name)) continue;
    Box& touched = code.touched[name];
    touched = hull(touched, use.box);
    use.box = inside->second.box;
  }
}

// Adds the reads of an update from its own Func to the region that earlier stages compute.
void NestEmitter::widen_by_own_reads(Member& member, Emitted& code) const {
  const auto self = code.uses.find(member.f->name());
  if (self == code.uses.end()) return;
  Box wider = hull(member.need, self->second.box);
  // Along a slide every stage must stay inside of the part. For an empty part, the hull would mix ends of two
  // regions, and an earlier stage alone would run again.
  for (const Slide& slide : member.slides) wider[slide.dimension] = member.need[slide.dimension];
  member.need = std::move(wider);
  check_bounded(program_, *member.f, member.need);
  code.uses.erase(self);
}

namespace {

// Makes boxes that differ between two branches depend on the condition over parameters.
void choose_box(const Expr& condition, Box& chosen, Box& other) {
  for (size_t d = 0; d < std::min(chosen.size(), other.size()); d++) {
    for (auto end : {&Interval::min, &Interval::max}) {
      Expr &a = chosen[d].*end, &b = other[d].*end;
      if (!a.defined() || !b.defined() || is_zero(simplify(a - b))) continue;
      a = b = select(condition, a, b);
    }
  }
}

}  // namespace

// Emits the nest once per specialization of its first stage: if (condition) this variant, else the next.
Emitted NestEmitter::emit_variants(const FusedNest& nest, std::vector<NestStage> stages,
                                   ComputePlace& home) {
  const NestStage& first = stages[0];
  if (first.f->stages[first.stage].schedule.specializations.empty())
    return emit_nest(nest, std::move(stages), home);
  const std::vector<Variant> variants = variants_of(*first.f, first.stage);
  Emitted result;
  for (auto it = variants.rbegin(); it != variants.rend(); ++it) {
    Emitted code;
    if (it->failure.empty()) {
      std::vector<NestStage> variant = stages;
      variant[0].f = &it->func;
      code = emit_variants(nest, std::move(variant), home);
    } else {
      code.stmt = fail_specialized(*first.f, it->failure);
    }
    if (!it->condition.defined()) {
      result = std::move(code);
      continue;
    }
    code.stmt = make_if(it->condition, code.stmt, result.stmt);
    for (auto& [name, use] : result.uses) choose_box(it->condition, code.uses[name].box, use.box);
    for (auto& [name, box] : result.storage) choose_box(it->condition, code.storage[name], box);
    merge_code(code, result);
    result = std::move(code);
  }
  return result;
}

namespace {

Loop& loop_at(std::vector<Loop>& loops, int depth) { return loops[loops.size() - depth]; }

// The difference between the loop variable of a stage and that of the stage it is aligned to.
Expr shift_of(LoopAlignStrategy align, const Interval& own, const Interval& other) {
  switch (align) {
    case LoopAlignStrategy::AlignStart:
      return own.min - other.min;
    case LoopAlignStrategy::AlignEnd:
      return own.max - other.max;
    case LoopAlignStrategy::NoAlign:
    case LoopAlignStrategy::Auto:
      return 0;
  }
  internal_error("an unknown way to align loops");
}

}  // namespace

Emitted NestEmitter::emit_nest(const FusedNest& nest, std::vector<NestStage> stages,
                               ComputePlace& home) {
  for (size_t i = 0; i < stages.size(); i++) {
    NestStage& stage = stages[i];
    const FusedStage& plan = nest.stages[i];
    stage.nest = build_stage_nest(*stage.f, stage.stage, stage.domain);
    if (plan.joins < 0) continue;
    NestStage& host = stages[plan.joins];
    NestStage& other = stages[plan.aligned_to];
    host.guests.push_back(static_cast<int>(i));
    for (int d = 1; d <= plan.depth; d++) {
      Loop& loop = loop_at(stage.nest.loops, d);
      loop.runs_in = loop_at(host.nest.loops, d).known_as();
      const auto more = static_cast<size_t>(d) <= other.shift.size() ? other.shift[d - 1] : Expr(0);
      const Expr shift =
          shift_of(plan.align[d - 1], loop.range(), loop_at(other.nest.loops, d).range());
      const bool aligned = plan.align[d - 1] == LoopAlignStrategy::AlignStart ||
                           plan.align[d - 1] == LoopAlignStrategy::AlignEnd;
      stage.shift.push_back(simplify(aligned ? shift + more : shift));
    }
  }
  Emitted code = emit_stage(nest, stages, 0, home);
  merge_strands(code);
  return code;
}

// Emits one stage and the stages that join its loops, up to the loops that it shares itself.
Emitted NestEmitter::emit_stage(const FusedNest& nest, std::vector<NestStage>& stages, int index,
                                ComputePlace& home) {
  NestStage& own = stages[index];
  const LoopedFunc& f = *own.f;
  std::vector<Loop>& loops = own.nest.loops;
  Emitted code;
  code.stmt = emit_definition(f, own.stage, own.nest);
  code.uses = requirements_of(f, own.stage, own.nest, values_);
  if (never_stores(f, own.stage, code.uses)) code.stmt = make_evaluate(0);
  code.overrun.leaves_domain = own.nest.rounds_up;
  code.overrun.counts = own.stage > 0 || !tolerates_any_values(f.stages[own.stage], values_);
  code = emit_children(computed_innermost_in(f), std::move(code), loops, 0, home);
  for (size_t i = 0; i < loops.size(); i++) {
    const int depth = static_cast<int>(loops.size() - i);
    if (depth <= nest.stages[index].depth) return code;
    for (const int guest : own.guests) {
      const FusedStage& plan = nest.stages[guest];
      if (plan.depth != depth) continue;
      std::vector<Expr> shift = stages[guest].shift;
      for (int d = 0; d < depth && d < static_cast<int>(own.shift.size()); d++)
        shift[d] = simplify(shift[d] - own.shift[d]);
      Emitted joining = emit_stage(nest, stages, guest, home);
      join(code, {loops, home}, std::move(joining), stages[guest].nest.loops, shift, depth);
    }
    code = emit_children(children_at(f, own.stage, loops[i]), std::move(code), loops, i, home);
    code = store_here(f, own.stage, std::move(code), loops, i, home);
    check_parallel(f, loops[i], code);
    wrap(loops[i], code);
  }
  return code;
}

}  // namespace retrograde::lower
