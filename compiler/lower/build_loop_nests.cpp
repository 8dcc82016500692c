#include "lower/build_loop_nests.h"

#include <algorithm>
#include <set>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/emit_definition.h"
#include "lower/stage_nest.h"
#include "lower/value_bounds.h"
#include "retrograde_runtime.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

Box buffer_box(const std::string& buffer, int dimensions) {
  Box box;
  for (int d = 0; d < dimensions; d++) {
    Expr min = variable(text(buffer, ".min.", d));
    box.push_back({min, min + variable(text(buffer, ".extent.", d)) - 1});
  }
  return box;
}

namespace {

using Bindings = std::vector<std::pair<std::string, Expr>>;

// A statement with what it needs from outside of it. All boxes speak of names that are bound
// outside the statement, except for `unranged` loops, over which they are still to be extended.
struct Emitted {
  Stmt stmt;
  Requirements uses;
  std::map<std::string, Box> storage;  // Funcs computed inside but stored further out
  std::vector<Loop> unranged;
};

bool is_trivial(const Expr& e) { return is_const(e) || e.as<Variable>(); }

void map_boxes(Emitted& code, const std::function<void(Box&)>& map) {
  for (auto& [name, use] : code.uses) map(use.box);
  for (auto& [name, box] : code.storage) map(box);
}

// Extends every box over the loops that were wrapped around the statement since the last call.
void range_over_loops(Emitted& code) {
  if (code.unranged.empty()) return;
  Scope<Interval> loops;
  for (const Loop& loop : code.unranged) loops.push(loop.name, loop.range());
  map_boxes(code, [&](Box& box) {
    for (Interval& side : box) {
      if (side.min.defined()) side.min = bounds_of(side.min, loops).min;
      if (side.max.defined()) side.max = bounds_of(side.max, loops).max;
    }
  });
  code.unranged.clear();
}

// Boxes in terms of `bindings` become boxes in terms of what the bindings are made of.
void expand_bindings(Emitted& code, const Bindings& bindings) {
  if (bindings.empty()) return;
  Substitution values;
  for (const auto& [name, value] : bindings) values[name] = substitute(value, values);
  map_boxes(code, [&](Box& box) {
    for (Interval& side : box) {
      if (side.min.defined()) side.min = simplify(substitute(side.min, values));
      if (side.max.defined()) side.max = simplify(substitute(side.max, values));
    }
  });
}

void merge_storage(std::map<std::string, Box>& into, const std::map<std::string, Box>& from) {
  for (const auto& [name, box] : from) into[name] = hull(into[name], box);
}

std::vector<Range> ranges_of(const Box& box) {
  std::vector<Range> ranges;
  for (const Interval& side : box) ranges.push_back({side.min, simplify(side.max - side.min + 1)});
  return ranges;
}

class NestEmitter {
 public:
  explicit NestEmitter(const Program& program) : program_(program), values_(value_bounds(program)) {
    for (size_t i = 0; i < program.funcs.size(); i++) note_site(static_cast<int>(i));
  }

  LoopNests emit() {
    LoopNests nests;
    Emitted nothing;
    Emitted all = emit_site(root_, nothing, nests.bounds);
    all.stmt = realize_stored(
        all, [](const LoopLevel& level) { return level.kind == LoopLevel::Kind::Root; });
    check_everything_found_its_place(all);
    for (auto& [name, use] : all.uses)
      if (use.is_image) nests.images[name] = use;
    nests.body = all.stmt;
    nests.outputs = std::move(outputs_);
    return nests;
  }

 private:
  const Program& program_;
  const ValueBounds values_;
  std::vector<int> root_, innermost_;  // indices into program_.funcs, producers first
  std::map<std::pair<std::string, std::string>, std::vector<int>>
      at_;                               // (consumer, loop) -> Funcs computed there
  std::set<std::string> storage_sites_;  // "consumer.loop" that store something
  std::map<std::string, Box> outputs_;
  std::set<std::string> computed_;

  void note_site(int index) {
    const LoopedFunc& f = program_.funcs[index];
    const LoopLevel& level = f.schedule.compute_level;
    if (f.is_output || level.kind == LoopLevel::Kind::Root) {
      root_.push_back(index);
    } else if (f.is_computed_innermost()) {
      innermost_.push_back(index);
    } else {
      at_[{level.func, level.var}].push_back(index);
    }
    const LoopLevel& store = f.schedule.store_level;
    if (store.kind == LoopLevel::Kind::At) storage_sites_.insert(store.func + "\n" + store.var);
  }

  static bool is_stored_where_computed(const LoopedFunc& f) {
    const LoopLevel& compute = f.schedule.compute_level;
    const LoopLevel& store = f.schedule.store_level;
    if (store.kind == LoopLevel::Kind::Inlined) return true;
    return store.kind == compute.kind && store.func == compute.func && store.var == compute.var;
  }

  // ---- one site: Funcs that are computed together, just outside `inner` ----

  Emitted emit_site(const std::vector<int>& children, Emitted inner, Bindings& bindings) {
    for (auto it = children.rbegin(); it != children.rend(); ++it) {
      const LoopedFunc& f = program_.funcs[*it];
      if (!f.is_output && !inner.uses.count(f.name())) continue;  // not needed at this site
      inner = emit_func_around(f, std::move(inner), bindings);
    }
    return inner;
  }

  // produce f; consume f { inner }
  Emitted emit_func_around(const LoopedFunc& f, Emitted inner, Bindings& bindings) {
    Box required;
    if (auto use = inner.uses.find(f.name()); use != inner.uses.end()) {
      required = use->second.box;
      inner.uses.erase(use);
    }
    computed_.insert(f.name());
    Emitted result = emit_func(f, required, bindings);
    Box allocated = std::move(result.storage[f.name()]);
    result.storage.erase(f.name());
    merge_footprints(result.uses, inner.uses);
    merge_storage(result.storage, inner.storage);
    Stmt produce = make_producer_consumer(f.name(), true, result.stmt);
    Stmt consume =
        inner.stmt.defined() ? make_producer_consumer(f.name(), false, inner.stmt) : inner.stmt;
    result.stmt = make_block({produce, consume});
    if (f.is_output) {
      outputs_[f.name()] = allocated;
    } else if (is_stored_where_computed(f)) {
      result.stmt = make_realize(f.name(), f.func->types, f.schedule.memory, ranges_of(allocated),
                                 result.stmt);
    } else {
      result.storage[f.name()] = allocated;
    }
    return result;
  }

  // All stages of f over `required`. The box that its storage must have comes back in storage[f].
  Emitted emit_func(const LoopedFunc& f, Box required, Bindings& bindings) {
    std::vector<Stmt> stmts;
    if (f.is_output) {
      Box buffer = buffer_box(value_buffer_name(*f.func, 0), f.func->dimensions());
      outputs_[f.name()] = required;  // what others read of it must lie inside, too
      required = buffer;
    }
    check_bounded(f, required);
    apply_promised_bounds(f, required, stmts);
    Emitted result;
    std::vector<Stmt> stages(f.stages.size());
    Box need = required;
    for (int s = static_cast<int>(f.stages.size()) - 1; s >= 0; s--) {
      Emitted stage = emit_stage(f, s, bind_domain(f, s, need, bindings));
      if (auto self = stage.uses.find(f.name()); self != stage.uses.end()) {
        need = hull(need, self->second.box);
        check_bounded(f, need);
        stage.uses.erase(self);
      }
      stages[s] = stage.stmt;
      merge_footprints(result.uses, stage.uses);
      merge_storage(result.storage, stage.storage);
    }
    stmts.insert(stmts.end(), stages.begin(), stages.end());
    result.stmt = make_block(std::move(stmts));
    for (Interval& side : need) side = {simplify(side.min), simplify(side.max)};
    if (f.is_output) need = hull(need, outputs_[f.name()]);
    result.storage[f.name()] = std::move(need);
    return result;
  }

  void check_bounded(const LoopedFunc& f, const Box& box) const {
    for (size_t d = 0; d < box.size(); d++) {
      if (box[d].is_bounded()) continue;
      user_error(text("compute ", quoted(f.name())),
                 "the region of a Func that its consumers read must be bounded",
                 text("dimension ", d, " (", quoted(f.func->args[d]), ") is read without a ",
                      box[d].has_lower_bound() ? "upper" : "lower", " bound by ", consumers_of(f)),
                 "Clamp the index that depends on data, as in clamp(index, 0, extent - 1), or "
                 "promise its range with "
                 "unsafe_promise_clamped");
    }
  }

  std::string consumers_of(const LoopedFunc& f) const {
    std::string names;
    for (const LoopedFunc& other : program_.funcs) {
      for (const FuncPtr& callee : direct_callees(*other.func)) {
        if (callee == f.func) names += (names.empty() ? "" : ", ") + quoted(other.name());
      }
    }
    return names.empty() ? quoted(f.name()) : names;
  }

  // Func::bound: the loops cover exactly what was promised; a check makes sure that it is enough.
  void apply_promised_bounds(const LoopedFunc& f, Box& box, std::vector<Stmt>& checks) const {
    for (const Bound& bound : f.schedule.bounds) {
      size_t d =
          std::find(f.func->args.begin(), f.func->args.end(), bound.var) - f.func->args.begin();
      RETROGRADE_ASSERT(d < box.size(), "bound on an unknown dimension");
      Interval promised;
      promised.min = bound.min.defined() ? bound.min : box[d].min;
      promised.max = simplify(promised.min + bound.extent - 1);
      checks.push_back(bound_check(f, static_cast<int>(d), box[d], promised));
      box[d] = promised;
    }
  }

  static Stmt bound_check(const LoopedFunc& f, int d, const Interval& required,
                          const Interval& promised) {
    Expr holds = simplify(promised.min <= required.min && required.max <= promised.max);
    std::vector<Expr> error = {Expr(int32_t{retrograde_error_explicit_bounds_too_small}),
                               Expr(text("cannot compute ", quoted(f.name()), ": its dimension ", d,
                                         " (", quoted(f.func->args[d]), ") was bounded to [")),
                               promised.min,
                               Expr(", "),
                               promised.max,
                               Expr("], but its consumers need ["),
                               required.min,
                               Expr(", "),
                               required.max,
                               Expr("]. Bound it to what they read.")};
    return make_assert(holds, call_op(Op::error, Int(32), error));
  }

  // ---- one stage ----

  // Names the region of a stage, and gives it in terms of the names. `need` becomes the same.
  Domain bind_domain(const LoopedFunc& f, int s, Box& need, Bindings& bindings) const {
    Domain domain;
    const std::string prefix = stage_prefix(f.name(), s);
    for (size_t d = 0; d < need.size(); d++)
      domain[f.func->args[d]] = bind(prefix + f.func->args[d], need[d], bindings);
    for (const ReductionVariable& r : f.stages[s].rvars) {
      Expr min = cast(Int(32), r.min), extent = cast(Int(32), r.extent);
      Interval range{min, simplify(min + extent - 1)};
      domain[r.var] = bind(prefix + r.var, range, bindings);
    }
    return domain;
  }

  static Range bind(const std::string& name, Interval& range, Bindings& bindings) {
    Expr extent = simplify(range.max - range.min + 1);
    range.min = bind(name + ".min", simplify(range.min), bindings);
    if (is_const(extent)) {
      range.max = simplify(range.min + extent - 1);
    } else {
      range.max = bind(name + ".max", simplify(range.max), bindings);
      extent = simplify(range.max - range.min + 1);
    }
    return {range.min, extent};
  }

  static Expr bind(const std::string& name, const Expr& value, Bindings& bindings) {
    if (is_trivial(value)) return value;
    bindings.emplace_back(name, value);
    return variable(name);
  }

  Emitted emit_stage(const LoopedFunc& f, int s, const Domain& domain) {
    StageNest nest = build_stage_nest(f, s, domain);
    Emitted code;
    code.stmt = emit_definition(f, s, nest);
    code.uses = requirements_of(f, s, nest, values_);
    code = emit_children(computed_innermost_in(f), std::move(code));
    for (const Loop& loop : nest.loops) {
      code = emit_children(children_at(f, s, loop), std::move(code));
      code = store_here(f, s, loop, std::move(code));
      check_no_shared_storage(f, loop, code);
      code.stmt = make_for(loop.name, loop.min, loop.extent, loop.for_type, code.stmt);
      code.unranged.push_back(loop);
    }
    range_over_loops(code);
    return code;
  }

  // An update that reads its own Func does not compute it again.
  std::vector<int> computed_innermost_in(const LoopedFunc& f) const {
    std::vector<int> children = innermost_;
    std::erase_if(children, [&](int i) { return program_.funcs[i].func == f.func; });
    return children;
  }

  std::vector<int> children_at(const LoopedFunc& f, int s, const Loop& loop) const {
    auto it = at_.find({f.name(), loop.var});
    if (it == at_.end()) return {};
    std::vector<int> children;
    for (int index : it->second) {
      int stage = program_.funcs[index].schedule.compute_level.stage;
      if (stage < 0 || stage == s) children.push_back(index);
    }
    return children;
  }

  // Funcs computed just outside `code` and inside the next loop; their bounds are bound around
  // them.
  Emitted emit_children(const std::vector<int>& children, Emitted code) {
    bool any = std::any_of(children.begin(), children.end(),
                           [&](int i) { return code.uses.count(program_.funcs[i].name()); });
    if (!any) return code;
    range_over_loops(code);
    Bindings bindings;
    code = emit_site(children, std::move(code), bindings);
    for (auto it = bindings.rbegin(); it != bindings.rend(); ++it)
      code.stmt = make_let(it->first, it->second, code.stmt);
    expand_bindings(code, bindings);
    return code;
  }

  Emitted store_here(const LoopedFunc& f, int s, const Loop& loop, Emitted code) {
    if (code.storage.empty() || !storage_sites_.count(f.name() + "\n" + loop.var)) return code;
    range_over_loops(code);
    code.stmt = realize_stored(code, [&](const LoopLevel& level) {
      return level.kind == LoopLevel::Kind::At && level.func == f.name() && level.var == loop.var &&
             (level.stage < 0 || level.stage == s);
    });
    return code;
  }

  template <class IsHere>
  Stmt realize_stored(Emitted& code, IsHere&& is_here) {
    Stmt stmt = code.stmt;
    for (auto it = code.storage.begin(); it != code.storage.end();) {
      const LoopedFunc& f = *program_.find(it->first);
      if (is_here(f.schedule.store_level)) {
        stmt =
            make_realize(f.name(), f.func->types, f.schedule.memory, ranges_of(it->second), stmt);
        it = code.storage.erase(it);
      } else {
        ++it;
      }
    }
    return stmt;
  }

  void check_no_shared_storage(const LoopedFunc& f, const Loop& loop, const Emitted& code) const {
    if (loop.for_type != ForType::Parallel || code.storage.empty()) return;
    const std::string& g = code.storage.begin()->first;
    user_error(
        text("store ", quoted(g), " outside of the parallel loop over ", quoted(loop.var), " of ",
             quoted(f.name())),
        "iterations of a parallel loop must not share the storage of what each of them computes",
        text(quoted(g), " is computed inside that loop"),
        text("Store ", quoted(g), " at ", quoted(loop.var),
             " or deeper, or compute it outside of the loop"));
  }

  // ---- what is left at root ----

  std::string loops_of(const std::string& func) const {
    const LoopedFunc* f = program_.find(func);
    if (!f) return text(quoted(func), " has no loops: it is inlined or not part of this pipeline");
    std::string names;
    for (size_t s = 0; s < f->stages.size(); s++) {
      for (const Dim& dim : f->stages[s].schedule.dims)
        names += (names.empty() ? "" : ", ") + quoted(dim.var);
    }
    return text("the loops of ", quoted(func), " are ", names.empty() ? "none" : names);
  }

  void check_everything_found_its_place(const Emitted& all) const {
    for (const LoopedFunc& f : program_.funcs) {
      const LoopLevel& level = f.schedule.compute_level;
      bool is_left = all.uses.count(f.name()) || all.storage.count(f.name());
      if (!is_left) continue;
      bool is_stored = all.storage.count(f.name());
      const LoopLevel& asked = is_stored ? f.schedule.store_level : level;
      user_error(
          text(is_stored ? "store " : "compute ", quoted(f.name()), " at ", quoted(asked.var),
               " of ", quoted(asked.func)),
          text("a Func must be ", is_stored ? "stored" : "computed",
               " at a loop that encloses every use of it",
               is_stored ? " and its compute level" : ""),
          text(loops_of(asked.func), ", and ", quoted(f.name()), " is used by ", consumers_of(f)),
          "Name a loop that encloses all of these uses, or call compute_root()");
    }
  }
};

}  // namespace

LoopNests build_loop_nests(const Program& program) { return NestEmitter(program).emit(); }

}  // namespace retrograde::ir
