// Emits extern stages: the loops around the calls of the C function, and the queries for its regions.
#include "ir/build.h"
#include "lower/nests/extern_stage.h"
#include "lower/nests/nest_emitter.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

// The loops around the calls of an extern stage, and the region of one call.
struct ExternLoops {
  std::vector<Loop> loops;  // innermost first
  Box slice;
  Expr has_points;
};

ExternLoops extern_loops(const LoopedFunc& f, const Domain& domain) {
  ExternLoops result;
  StageNest nest = build_stage_nest(f, 0, domain);
  Scope<Interval> in_call;
  for (size_t i = 0; i < nest.loops.size(); i++) {
    const Loop& loop = nest.loops[i];
    if (f.stages[0].schedule.dims[i].is_in_call)
      in_call.push(loop.name, loop.range());
    else
      result.loops.push_back(loop);
  }
  std::vector<Expr> conditions;
  for (const std::string& arg : f.func->args) {
    const Range& all = domain.at(arg);
    const Interval slice = bounds_of(nest.guarded_coordinate.at(arg), in_call);
    result.slice.push_back(
        {simplify(max(slice.min, all.min)), simplify(min(slice.max, all.min + all.extent - 1))});
    conditions.push_back(result.slice.back().min <= result.slice.back().max);
  }
  result.has_points = simplify(conjunction(conditions));
  return result;
}

Box box_of(const LoopedFunc& f, const Domain& domain) {
  return mapped(f.func->args, [&](const std::string& arg) {
    const Range& range = domain.at(arg);
    return Interval{range.min, range.min + range.extent - 1};
  });
}

}  // namespace

// Emits an extern stage. Without loops of its own the C function computes everything at once, possibly more than
// required.
Emitted NestEmitter::emit_extern(Member& member, const Domain& domain, ComputePlace& site) {
  const LoopedFunc& f = *member.f;
  ExternLoops nest = extern_loops(f, domain);
  if (!nest.loops.empty())
    return emit_extern_loops(f, nest.loops, nest.slice, nest.has_points, site);
  const bool in_loops = !site.around.empty();
  Box computed;
  Emitted code = emit_extern_call(f, {box_of(f, domain), in_loops, false}, site, computed);
  member.need = computed;
  return code;
}

Emitted NestEmitter::emit_extern_call(const LoopedFunc& f, const ExternCall& call,
                                      ComputePlace& site, Box& computed) const {
  ExternStage stage = emit_extern_stage(program_, f, call);
  append(site.bindings, stage.bindings);
  for (const auto& [name, whole] : stage.parts) site.bind_part(name, whole);
  Emitted code;
  code.stmt = stage.call;
  code.uses = std::move(stage.uses);
  if (call.in_loops) {
    std::erase_if(code.uses, [](const auto& use) { return use.second.is_image; });
    code.uses[whole_region_of(f)].box = call.region;
  }
  computed = stage.computed;
  code.has_loops = true;
  return code;
}

// for each slice: the Funcs computed there; the C function on the slice
Emitted NestEmitter::emit_extern_loops(const LoopedFunc& f, std::vector<Loop>& loops,
                                       const Box& slice, const Expr& has_points,
                                       ComputePlace& home) {
  ComputePlace site(loops);
  Box computed;
  Emitted code = emit_extern_call(f, {slice, true, true}, site, computed);
  code.stmt = make_if(has_points, code.stmt);
  code = emit_place(children_at(f, 0, loops[0]), std::move(code), site);
  code.stmt = make_lets(site.bindings, code.stmt);
  map_boxes(code, [&](const Box& box) { return site.whole(box); });
  for (size_t i = 0; i < loops.size(); i++) {
    if (i > 0) code = emit_children(children_at(f, 0, loops[i]), std::move(code), loops, i, home);
    code = store_here(f, 0, std::move(code), loops, i, home);
    check_parallel(f, loops[i], code);
    wrap(loops[i], code);
  }
  range_over_loops(code);
  return code;
}

// Queries extern stages inside of the last emitted loops for their complete regions.
void NestEmitter::ask_wholes(Emitted& code, ComputePlace& root) const {
  for (const LoopedFunc& f : program_.funcs) {
    if (!f.func->is_extern()) continue;
    auto noted = code.uses.extract(whole_region_of(f));
    if (!noted) continue;
    ExternAnswer whole = ask_for_whole(f, noted.mapped().box);
    append(root.bindings, whole.bindings);
    for (const auto& [name, use] : whole.uses) {
      if (use.is_image) merge_footprints(code.uses, {{name, use}});
    }
  }
}

}  // namespace retrograde::lower
