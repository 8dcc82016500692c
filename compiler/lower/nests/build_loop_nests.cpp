#include "lower/nests/build_loop_nests.h"

#include <algorithm>

#include "ir/build.h"
#include "lower/checks/nest_checks.h"
#include "lower/nests/nest_emitter.h"
#include "lower/nests/own_joining.h"
#include "lower/nests/root_statement.h"
#include "lower/nests/shared_loops.h"
#include "simplify/simplify_memo.h"

namespace retrograde::lower {

NestEmitter::NestEmitter(const Program& program, const LoopNestOptions& options)
    : program_(program),
      options_(options),
      values_(value_bounds(program)),
      storage_(program, options.slide),
      groups_(fused_groups(program)),
      group_of_(program.funcs.size()) {
  for (size_t g = 0; g < groups_.size(); g++) {
    for (const int f : groups_[g].funcs) group_of_[f] = static_cast<int>(g);
  }
  for (size_t i = 0; i < program.funcs.size(); i++) note_site(static_cast<int>(i));
}

Stmt NestEmitter::emit() {
  ComputePlace root({});
  Emitted all = emit_place(root_, Emitted(), root);
  all.stmt = storage_.realize_stored(
      all, [](const LoopLevel& level) { return level.kind == LoopLevel::Kind::Root; });
  check_everything_found_its_place(all);
  RootStatement result;
  result.bounds = program_.shared;
  result.bounds.insert(result.bounds.end(), root.bindings.begin(), root.bindings.end());
  for (auto& [name, use] : all.uses)
    if (use.is_image) result.regions[name] = use.box;
  for (const LoopedFunc& f : program_.funcs) {
    for (size_t i = 0; f.is_output && i < f.func->types.size(); i++)
      result.regions[value_buffer_name(*f.func, static_cast<int>(i))] = outputs_.at(f.name());
  }
  result.loops = storage_.with_layouts(all.stmt);
  return joined(result);
}

void NestEmitter::note_site(int index) {
  const LoopedFunc& f = program_.funcs[index];
  const LoopLevel& level = f.schedule.compute_level;
  if (f.is_output || level.kind == LoopLevel::Kind::Root) {
    root_.push_back(index);
  } else if (f.is_computed_innermost()) {
    innermost_.push_back(index);
  } else {
    at_[{level.func, level.var}].push_back(index);
  }
}

// An update that reads its own Func does not compute it again.
std::vector<int> NestEmitter::computed_innermost_in(const LoopedFunc& f) const {
  std::vector<int> children = innermost_;
  std::erase_if(children, [&](int i) { return program_.funcs[i].func == f.func; });
  return children;
}

std::vector<int> NestEmitter::children_at(const LoopedFunc& f, int s, const Loop& loop) const {
  auto it = at_.find({f.name(), loop.var});
  if (it == at_.end()) return {};
  const int last = last_stage_in(f, s, loop.var);
  return filtered(it->second, [&](const int index) {
    const int stage = program_.funcs[index].schedule.compute_level.stage;
    return stage < 0 || (s <= stage && stage <= last);
  });
}

Emitted NestEmitter::emit_children(const std::vector<int>& children, Emitted code,
                                   std::vector<Loop>& loops, size_t i, ComputePlace& home) {
  if (children.empty()) return code;
  if (!code.strands.empty()) {
    const auto names = mapped(children, [&](int c) { return program_.funcs[c].name(); });
    gather_uses(code, {loops, home}, i, names, [&](const std::string& name) {
      return !is_stored_where_computed(*program_.find(name));
    });
    gather_boxes(code, {loops, home}, i, &Needs::touched, [&](const std::string& name) {
      return std::ranges::find(names, name) != names.end();
    });
  }
  bool any = std::any_of(children.begin(), children.end(),
                         [&](int c) { return code.uses.count(program_.funcs[c].name()); });
  if (!any) return code;
  range_over_loops(code);
  ComputePlace site({loops.begin() + i, loops.end()});
  code = emit_place(children, std::move(code), site);
  code.stmt = make_lets(site.bindings, code.stmt);
  if (site.has_names()) map_boxes(code, [&](const Box& box) { return site.whole(box); });
  return code;
}

Emitted NestEmitter::store_here(const LoopedFunc& f, int s, Emitted code, std::vector<Loop>& loops,
                                size_t i, ComputePlace& home) {
  const Loop& loop = loops[i];
  if (!storage_.is_site(f, loop)) return code;
  const int last = last_stage_in(f, s, loop.var);
  const auto is_here = [&](const LoopLevel& level) {
    return level.kind == LoopLevel::Kind::At && level.func == f.name() && level.var == loop.var &&
           (level.stage < 0 || (s <= level.stage && level.stage <= last));
  };
  gather_boxes(code, {loops, home}, i, &Needs::storage, [&](const std::string& name) {
    const FuncPlacement& schedule = storage_.stored_func(name)->schedule;
    return is_here(schedule.store_level) || is_here(schedule.hoist_level);
  });
  if (code.storage.empty()) return code;
  code.stmt = storage_.realize_stored(code, is_here);
  return code;
}

void NestEmitter::check_parallel(const LoopedFunc& f, const Loop& loop, const Emitted& code) const {
  if (!runs_at_once(loop.runs)) return;
  const auto check = [&](const Needs& needs) {
    if (needs.storage.empty()) return;
    check_no_shared_storage(f, loop, storage_.stored_func(needs.storage.begin()->first)->name());
  };
  check(code);
  for (const Strand& strand : code.strands) check(strand);
}

void NestEmitter::check_everything_found_its_place(const Emitted& all) const {
  for (const LoopedFunc& f : program_.funcs) {
    if (all.storage.count(place_name(f.name()))) check_place_found(program_, f);
    bool is_stored = all.storage.count(f.name());
    if (is_stored || all.uses.count(f.name())) check_found_its_place(program_, f, is_stored);
  }
}

Stmt build_loop_nests(const Program& program, const LoopNestOptions& options) {
  const simplification::SimplifyMemo memo;
  return NestEmitter(program, options).emit();
}

}  // namespace retrograde::lower
