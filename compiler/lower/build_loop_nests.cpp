#include "lower/build_loop_nests.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <set>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/emit_definition.h"
#include "lower/extern_stage.h"
#include "lower/nest_checks.h"
#include "lower/site.h"
#include "lower/specialize.h"
#include "lower/stage_nest.h"
#include "lower/storage_folding.h"
#include "lower/value_bounds.h"
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

// A statement with what it needs from outside of it. All boxes speak of names that are bound
// outside the statement, except for `unranged` loops, over which they are still to be extended.
struct Emitted {
  Stmt stmt;
  Requirements uses;
  std::map<std::string, Box> storage;  // Funcs computed inside but stored further out
  std::vector<Loop> unranged;
  int lead = 0;            // iterations of the loop around that run before its first
  bool has_loops = false;  // that stay loops
  bool has_vectors = false;
};

void map_boxes(Emitted& code, const std::function<Box(const Box&)>& map) {
  for (auto& [name, use] : code.uses) use.box = map(use.box);
  for (auto& [name, box] : code.storage) box = map(box);
}

Box ranged_over(const std::vector<Loop>& loops, Box box) {
  if (loops.empty()) return box;
  Scope<Interval> ranges;
  for (const Loop& loop : loops) ranges.push(loop.name, loop.range());
  for (Interval& side : box) {
    if (side.min.defined()) side.min = bounds_of(side.min, ranges).min;
    if (side.max.defined()) side.max = bounds_of(side.max, ranges).max;
  }
  return box;
}

// Extends every box over the loops that were wrapped around the statement since the last call.
void range_over_loops(Emitted& code) {
  if (code.unranged.empty()) return;
  map_boxes(code, [&](const Box& box) { return ranged_over(code.unranged, box); });
  code.unranged.clear();
}

void merge_storage(std::map<std::string, Box>& into, const std::map<std::string, Box>& from) {
  for (const auto& [name, box] : from) into[name] = hull(into[name], box);
}

Box simplified(Box box) {
  for (Interval& side : box) {
    if (side.min.defined()) side.min = simplify(side.min);
    if (side.max.defined()) side.max = simplify(side.max);
  }
  return box;
}

class NestEmitter {
 public:
  NestEmitter(const Program& program, const LoopNestOptions& options)
      : program_(program), options_(options), values_(value_bounds(program)) {
    for (size_t i = 0; i < program.funcs.size(); i++) note_site(static_cast<int>(i));
  }

  LoopNests emit() {
    LoopNests nests;
    Site root({});
    Emitted all = emit_site(root_, Emitted(), root);
    nests.bounds = std::move(root.bindings);
    all.stmt = realize_stored(
        all, [](const LoopLevel& level) { return level.kind == LoopLevel::Kind::Root; });
    check_everything_found_its_place(all);
    for (auto& [name, use] : all.uses)
      if (use.is_image) nests.images[name] = use;
    nests.body = all.stmt;
    nests.outputs = std::move(outputs_);
    nests.async_room = std::move(async_room_);
    for (const auto& [name, folds] : folds_) {
      for (const Fold& fold : folds) nests.folds[name].push_back(fold.factor);
    }
    return nests;
  }

 private:
  const Program& program_;
  const LoopNestOptions options_;
  const ValueBounds values_;
  std::vector<int> root_, innermost_;  // indices into program_.funcs, producers first
  std::map<std::pair<std::string, std::string>, std::vector<int>>
      at_;                               // (consumer, loop) -> Funcs computed there
  std::set<std::string> storage_sites_;  // "consumer.loop" that store something
  std::map<std::string, Box> outputs_;
  std::map<std::string, std::vector<Fold>> folds_;
  std::map<std::string, int> async_room_;

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
    const LoopLevel& hoist = f.schedule.hoist_level;
    if (is_hoisted(f) && hoist.kind == LoopLevel::Kind::At)
      storage_sites_.insert(hoist.func + "\n" + hoist.var);
  }

  static bool is_stored_where_computed(const LoopedFunc& f) {
    const LoopLevel& compute = f.schedule.compute_level;
    const LoopLevel& store = f.schedule.store_level;
    if (store.kind == LoopLevel::Kind::Inlined) return true;
    return store.kind == compute.kind && store.func == compute.func && store.var == compute.var;
  }

  // ---- one site: Funcs that are computed together, just outside `inner` ----

  // A Func's part of the site: realize { if (lead) produce f; consume f { what came before } }
  struct Piece {
    const LoopedFunc* f;
    Stmt produce;
    int lead = 0;
    std::optional<Box> realized;
  };

  // From how many iterations before the loop's first on a Func is wanted: by the first and by the
  // last of its consumers.
  struct Wanted {
    int first = 0, last = 0;
  };

  Emitted emit_site(const std::vector<int>& children, Emitted code, Site& site) {
    std::vector<Piece> pieces;
    std::map<std::string, Wanted> wanted;
    Stmt inner = code.stmt;
    for (const auto& [name, use] : code.uses) wanted[name] = {};
    for (auto it = children.rbegin(); it != children.rend(); ++it) {
      const LoopedFunc& f = program_.funcs[*it];
      if (!f.is_output && !code.uses.count(f.name())) continue;  // not needed at this site
      pieces.push_back(emit_piece(f, code, wanted, site));
    }
    for (const Piece& piece : pieces) code.lead = std::max(code.lead, piece.lead);
    code.stmt = assemble(pieces, inner, code, site);
    return code;
  }

  Stmt assemble(const std::vector<Piece>& pieces, Stmt stmt, const Emitted& code,
                const Site& site) {
    stmt = running_from(0, stmt, code, site);
    for (const Piece& piece : pieces) {
      const std::string& name = piece.f->name();
      Stmt produce = make_producer_consumer(name, true, piece.produce);
      Stmt consume = stmt.defined() ? make_producer_consumer(name, false, stmt) : stmt;
      stmt = make_block({running_from(piece.lead, produce, code, site), consume});
      if (piece.realized) stmt = realize(*piece.f, *piece.realized, stmt);
    }
    return stmt;
  }

  // What starts later than the loop around does.
  static Stmt running_from(int lead, const Stmt& stmt, const Emitted& code, const Site& site) {
    if (lead == code.lead || !stmt.defined()) return stmt;
    const Loop& loop = site.around[0];
    Expr runs = variable(loop.name) >= simplify(loop.min - lead);
    return make_if(code.has_loops ? runs : likely(runs), stmt);
  }

  // Computes f: takes it out of what `code` uses, and adds what f itself needs.
  Piece emit_piece(const LoopedFunc& f, Emitted& code, std::map<std::string, Wanted>& wanted,
                   Site& site) {
    Box required;
    if (auto use = code.uses.find(f.name()); use != code.uses.end()) {
      required = use->second.box;
      code.uses.erase(use);
    }
    if (f.is_output) required = output_box(f, required);
    check_bounded(program_, f, required);
    std::vector<Stmt> checks;
    apply_promised_bounds(f, required, checks);
    const Wanted want = wanted[f.name()];
    const std::vector<Loop> loops = loops_to_storage(f, site);
    std::vector<Slide> slides;
    if (options_.slide && !loops.empty())
      slides = slides_of(f, site.whole(required), loops, site.around, want.first);
    if (want.first != want.last) clamp_to_needed(required, slides, site);

    Piece piece{&f, {}, slide_lead(slides, want.first, site), {}};
    Emitted made = emit_func(f, required, slides, site, std::move(checks));
    Box allocated = std::move(made.storage[f.name()]);
    made.storage.erase(f.name());
    for (const auto& [name, use] : made.uses) note_use(wanted, code, name, piece.lead);
    merge_code(code, made);
    if (f.is_output) {
      outputs_[f.name()] = allocated;
    } else {
      Box touched = hull(required, allocated);
      made.stmt = fold_storage(f, touched, loops, slides, code.has_vectors, site, made.stmt);
      if (f.schedule.async && !loops.empty()) note_async_room(f, slides, site.touched(touched));
      if (is_stored_where_computed(f)) {
        piece.realized = allocated;
        note_place(f, allocated, code.storage);
      } else {
        code.storage[f.name()] = hull(code.storage[f.name()], allocated);
      }
    }
    piece.produce = made.stmt;
    return piece;
  }

  static void note_use(std::map<std::string, Wanted>& wanted, const Emitted& code,
                       const std::string& name, int lead) {
    auto [it, is_first] = wanted.emplace(name, Wanted{lead, lead});
    if (is_first || !code.uses.count(name)) it->second = {lead, lead};
    it->second.first = std::max(it->second.first, lead);
    it->second.last = std::min(it->second.last, lead);
  }

  static int slide_lead(const std::vector<Slide>& slides, int lead, const Site& site) {
    for (const Slide& slide : slides) {
      if (slide.loop.name == site.around[0].name) return slide.lead;
    }
    return lead;
  }

  // Iterations before the first of a loop run for some consumers only; what the others would read
  // in them may lie outside of all that is ever needed. (A part that slides begins where it must.)
  static void clamp_to_needed(Box& required, const std::vector<Slide>& slides, Site& site) {
    const std::string& loop = site.around[0].name;
    const Box whole = site.whole(required), ever = ranged_over({site.around[0]}, whole);
    for (size_t d = 0; d < required.size(); d++) {
      bool slid = std::any_of(slides.begin(), slides.end(), [&](const Slide& slide) {
        return slide.dimension == static_cast<int>(d) && slide.loop.name == loop;
      });
      if (slid) continue;
      if (uses_variable(whole[d].min, loop)) required[d].min = max(required[d].min, ever[d].min);
      if (uses_variable(whole[d].max, loop)) required[d].max = min(required[d].max, ever[d].max);
    }
  }

  // Loops between the site and the storage of f, innermost first.
  static std::vector<Loop> loops_to_storage(const LoopedFunc& f, const Site& site) {
    std::vector<Loop> loops;
    if (is_stored_where_computed(f) || f.is_output) return loops;
    const LoopLevel& store = f.schedule.store_level;
    for (const Loop& loop : site.around) {
      if (store.kind == LoopLevel::Kind::At &&
          loop.name.compare(0, store.func.size() + 2, store.func + ".s") == 0 &&
          store.var == loop.var)
        break;
      loops.push_back(loop);
    }
    return loops;
  }

  Box output_box(const LoopedFunc& f, const Box& read) {
    check_storage_of_output(f);
    outputs_[f.name()] = read;  // what others read of it must lie inside, too
    return buffer_box(value_buffer_name(*f.func, 0), f.func->dimensions());
  }

  // All stages of f over `required`, or the parts of it that slides leave. The box that its storage
  // must have comes back in storage[f].
  Emitted emit_func(const LoopedFunc& f, const Box& required, const std::vector<Slide>& slides,
                    Site& site, std::vector<Stmt> stmts) {
    Emitted result;
    std::vector<Stmt> stages(f.stages.size());
    Box need = required;
    for (int s = static_cast<int>(f.stages.size()) - 1; s >= 0; s--) {
      bool is_last = s == static_cast<int>(f.stages.size()) - 1;
      Domain domain = bind_domain(f, s, need, is_last ? slides : std::vector<Slide>(), site);
      Emitted stage =
          f.func->is_extern() ? emit_extern(f, domain, site) : emit_variants(f, s, domain);
      if (auto self = stage.uses.find(f.name()); self != stage.uses.end()) {
        Box wider = hull(need, self->second.box);
        // Along a slide every stage stays inside of the part, and must: of a part that is empty a
        // hull would have one end, where an earlier stage alone would run again.
        for (const Slide& slide : slides) wider[slide.dimension] = need[slide.dimension];
        need = std::move(wider);
        check_bounded(program_, f, need);
        stage.uses.erase(self);
      }
      stages[s] = stage.stmt;
      merge_code(result, stage);
    }
    stmts.insert(stmts.end(), stages.begin(), stages.end());
    result.stmt = make_block(std::move(stmts));
    need = simplified(std::move(need));
    if (f.is_output) need = hull(need, outputs_[f.name()]);
    result.storage[f.name()] = std::move(need);
    return result;
  }

  // ---- what users promise or want of bounds ----

  // Func::bound: the loops cover exactly what was promised; a check makes sure that it is enough.
  // Func::align_bounds and align_extent: they cover more.
  void apply_promised_bounds(const LoopedFunc& f, Box& box, std::vector<Stmt>& checks) const {
    for (const Bound& bound : f.schedule.bounds) {
      size_t d =
          std::find(f.func->args.begin(), f.func->args.end(), bound.var) - f.func->args.begin();
      RETROGRADE_ASSERT(d < box.size(), "bound on an unknown dimension");
      if (bound.extent.defined()) {
        Interval promised;
        promised.min = bound.min.defined() ? bound.min : box[d].min;
        promised.max = simplify(promised.min + bound.extent - 1);
        checks.push_back(bound_check(f, static_cast<int>(d), box[d], promised));
        box[d] = promised;
      }
      if (bound.modulus.defined()) box[d] = aligned(box[d], bound);
    }
  }

  static Interval aligned(Interval range, const Bound& bound) {
    const Expr &m = bound.modulus, &r = bound.remainder;
    if (r.defined()) range.min = simplify((range.min - r) / m * m + r);
    Expr extent = range.max - range.min + 1;
    range.max = simplify(range.min + (extent + m - 1) / m * m - 1);
    return range;
  }

  // ---- one stage ----

  // Names the region of a stage, and gives it in terms of the names. `need` becomes the same.
  static Domain bind_domain(const LoopedFunc& f, int s, Box& need, const std::vector<Slide>& slides,
                            Site& site) {
    Domain domain;
    const std::string prefix = stage_prefix(f.name(), s);
    for (size_t d = 0; d < need.size(); d++) {
      auto slide = std::find_if(slides.begin(), slides.end(), [&](const Slide& candidate) {
        return candidate.dimension == static_cast<int>(d);
      });
      const std::string& arg = f.func->args[d];
      domain[arg] = slide == slides.end() ? site.bind(prefix + arg, need[d])
                                          : site.bind_part(prefix + arg, *slide, need[d]);
    }
    for (const ReductionVariable& r : f.stages[s].rvars) {
      Expr min = cast(Int(32), r.min), extent = cast(Int(32), r.extent);
      Interval range{min, simplify(min + extent - 1)};
      domain[r.var] = site.bind(prefix + r.var, range);
    }
    return domain;
  }

  Emitted emit_extern(const LoopedFunc& f, const Domain& domain, Site& site) const {
    ExternStage stage = emit_extern_stage(program_, f, domain);
    for (auto& binding : stage.bindings) site.bindings.push_back(std::move(binding));
    Emitted code;
    code.stmt = stage.call;
    code.uses = std::move(stage.uses);
    code.has_loops = true;
    return code;
  }

  Emitted emit_stage(const LoopedFunc& f, int s, const Domain& domain) {
    StageNest nest = build_stage_nest(f, s, domain);
    Emitted code;
    code.stmt = emit_definition(f, s, nest);
    code.uses = requirements_of(f, s, nest, values_);
    code = emit_children(computed_innermost_in(f), std::move(code), nest.loops, 0);
    for (size_t i = 0; i < nest.loops.size(); i++) {
      const Loop& loop = nest.loops[i];
      code = emit_children(children_at(f, s, loop), std::move(code), nest.loops, i);
      code = store_here(f, s, loop, std::move(code));
      if (loop.for_type == ForType::Parallel && !code.storage.empty())
        check_no_shared_storage(f, loop, stored_func(code.storage.begin()->first)->name());
      wrap(loop, code);
    }
    range_over_loops(code);
    return code;
  }

  // The stage as each specialization has it: if (condition) this one else the next.
  Emitted emit_variants(const LoopedFunc& f, int s, const Domain& domain) {
    if (f.stages[s].schedule.specializations.empty()) return emit_stage(f, s, domain);
    const std::vector<Variant> variants = variants_of(f, s);
    Emitted result;
    for (auto it = variants.rbegin(); it != variants.rend(); ++it) {
      Emitted code;
      if (it->failure.empty()) {
        code = emit_variants(it->func, s, domain);
      } else {
        code.stmt = fail_specialized(f, it->failure);
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

  // Where a condition over parameters chooses between two boxes, so does what needs to be there.
  static void choose_box(const Expr& condition, Box& chosen, Box& other) {
    for (size_t d = 0; d < std::min(chosen.size(), other.size()); d++) {
      for (auto end : {&Interval::min, &Interval::max}) {
        Expr &a = chosen[d].*end, &b = other[d].*end;
        if (!a.defined() || !b.defined() || is_zero(simplify(a - b))) continue;
        a = b = select(condition, a, b);
      }
    }
  }

  // All that `from` needs; the statement stays.
  static void merge_code(Emitted& into, const Emitted& from) {
    merge_footprints(into.uses, from.uses);
    merge_storage(into.storage, from.storage);
    into.has_loops |= from.has_loops;
    into.has_vectors |= from.has_vectors;
  }

  static void wrap(const Loop& loop, Emitted& code) {
    Expr min = code.lead > 0 ? simplify(loop.min - code.lead) : loop.min;
    Expr extent = code.lead > 0 ? simplify(loop.extent + code.lead) : loop.extent;
    code.stmt = make_for(loop.name, min, extent, loop.for_type, code.stmt, loop.partition);
    code.lead = 0;
    code.unranged.push_back(loop);
    code.has_loops |= loop.for_type == ForType::Parallel ||
                      (loop.for_type == ForType::Serial && !is_one(loop.extent));
    code.has_vectors |= loop.for_type == ForType::Vectorized;
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

  // Funcs computed just outside `code` and inside loops[i]; their bounds are bound around them.
  Emitted emit_children(const std::vector<int>& children, Emitted code,
                        const std::vector<Loop>& loops, size_t i) {
    bool any = std::any_of(children.begin(), children.end(),
                           [&](int c) { return code.uses.count(program_.funcs[c].name()); });
    if (!any) return code;
    range_over_loops(code);
    Site site({loops.begin() + i, loops.end()});
    code = emit_site(children, std::move(code), site);
    for (auto it = site.bindings.rbegin(); it != site.bindings.rend(); ++it)
      code.stmt = make_let(it->first, it->second, code.stmt);
    if (site.has_names()) map_boxes(code, [&](const Box& box) { return site.whole(box); });
    return code;
  }

  // ---- storage ----

  // `touched`: by the code of the site, in terms of its names.
  Stmt fold_storage(const LoopedFunc& f, const Box& touched, const std::vector<Loop>& loops,
                    const std::vector<Slide>& slides, bool is_vectorized, Site& site, Stmt stmt) {
    std::vector<FoldingLoop> windows;
    if (options_.slide && !loops.empty()) {
      windows.push_back({loops[0], site.touched(touched)});
      Box whole = site.whole(touched);
      for (size_t i = 1; i < loops.size(); i++) {
        whole = ranged_over({loops[i - 1]}, std::move(whole));
        windows.push_back({loops[i], whole});
      }
    }
    std::vector<Fold> folds = folds_of(f, windows, slides, site.around, is_vectorized);
    for (size_t d = 0; d < folds.size(); d++) {
      if (folds[d].touched.defined())
        stmt = make_block(
            {fold_check(f, static_cast<int>(d), folds[d].touched, folds[d].factor), stmt});
    }
    note_folds(f, std::move(folds));
    return stmt;
  }

  // Values that are each computed once, into a place of their own, can be computed at any time. In
  // folded storage of F coordinates, of which an iteration touches W and computes S, there is room
  // for (F - W) / S more.
  void note_async_room(const LoopedFunc& f, const std::vector<Slide>& slides, const Box& touched) {
    const std::vector<Fold>& folds = folds_.at(f.name());
    int room = slides.empty() ? 1 : 0;
    for (size_t d = 0; d < folds.size(); d++) {
      if (!folds[d].factor.defined()) continue;
      auto slide = std::find_if(slides.begin(), slides.end(), [&](const Slide& candidate) {
        return candidate.dimension == static_cast<int>(d);
      });
      const auto extent = [](const Interval& side) {
        return as_const_int(simplify(without_markers(side.max - side.min + 1)));
      };
      const auto fold = as_const_int(folds[d].factor), window = extent(touched[d]);
      const auto step = slide == slides.end() ? window : extent(slide->part);
      const bool known = fold && window && step && *step > 0 && *fold >= *window;
      const int here = known ? static_cast<int>((*fold - *window) / *step) + 1 : 1;
      room = room == 0 ? here : std::min(room, here);
    }
    auto [it, is_first] = async_room_.emplace(f.name(), room);
    if (!is_first && (it->second == 0 || (room != 0 && room < it->second))) it->second = room;
  }

  // A Func that is computed at several places folds where all of them allow it.
  void note_folds(const LoopedFunc& f, std::vector<Fold> folds) {
    auto [it, is_first] = folds_.emplace(f.name(), folds);
    for (size_t d = 0; d < folds.size() && !is_first; d++) {
      Expr& factor = it->second[d].factor;
      if (factor.defined() && folds[d].factor.defined()) {
        factor = simplify(max(factor, folds[d].factor));
      } else {
        factor = Expr();
      }
    }
  }

  static const StorageRule* rule_of(const LoopedFunc& f, size_t d) {
    for (const StorageRule& rule : f.schedule.storage_rules) {
      if (rule.var == f.func->args[d]) return &rule;
    }
    return nullptr;
  }

  Stmt realize(const LoopedFunc& f, const Box& box, Stmt stmt) {
    std::vector<Range> ranges;
    std::vector<Stmt> checks;
    for (size_t d = 0; d < box.size(); d++) {
      Range range{box[d].min, simplify(box[d].max - box[d].min + 1)};
      Expr& factor = folds_.at(f.name())[d].factor;
      auto extent = as_const_int(range.extent), fold = as_const_int(factor.defined() ? factor : 0);
      if (extent && fold && *extent <= *fold) factor = Expr();  // nothing to gain
      if (const StorageRule* rule = rule_of(f, d)) apply(*rule, f, d, range, factor, checks);
      ranges.push_back(range);
    }
    checks.push_back(make_realize(f.name(), f.func->types, f.schedule.memory, ranges, stmt));
    return make_block(checks);
  }

  static void apply(const StorageRule& rule, const LoopedFunc& f, size_t d, Range& range,
                    Expr& factor, std::vector<Stmt>& checks) {
    const int dimension = static_cast<int>(d);
    if (rule.fold.defined() && !factor.defined()) {  // no loop hands it on: it must hold all
      checks.push_back(fold_check(f, dimension, range.extent, rule.fold));
      factor = rule.fold;
    }
    if (rule.bound.defined()) {
      checks.push_back(storage_check(f, dimension, range.extent, rule.bound));
      range.extent = rule.bound;
    }
    if (rule.alignment.defined())
      range.extent =
          simplify((range.extent + rule.alignment - 1) / rule.alignment * rule.alignment);
  }

  // Storage that lies in a place further out: room for the largest that it is at any time.
  void note_place(const LoopedFunc& f, const Box& box, std::map<std::string, Box>& storage) const {
    if (!is_hoisted(f)) return;
    Box room;
    for (size_t d = 0; d < box.size(); d++) {
      Expr extent = box[d].max - box[d].min + 1;
      if (const StorageRule* rule = rule_of(f, d)) {
        if (rule->bound.defined()) extent = rule->bound;
        if (rule->alignment.defined())
          extent = (extent + rule->alignment - 1) / rule->alignment * rule->alignment;
        if (rule->fold.defined()) extent = max(extent, rule->fold);
      }
      room.push_back({0, simplify(extent - 1)});
    }
    Box& place = storage[place_name(f.name())];
    place = hull(place, room);
  }

  // The Func whose storage an entry of Emitted::storage is, or is the place of.
  const LoopedFunc* stored_func(const std::string& name) const {
    const LoopedFunc* f = program_.find(name);
    return f ? f : program_.find(name.substr(0, name.rfind('.')));
  }

  Stmt realize_place(const LoopedFunc& f, const Box& room, const Stmt& stmt) const {
    check_room(f, room);
    std::vector<Range> ranges;
    for (const Interval& side : room) ranges.push_back({0, simplify(side.max + 1)});
    return make_realize(place_name(f.name()), f.func->types, f.schedule.memory, ranges, stmt);
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
      const LoopedFunc& f = *stored_func(it->first);
      const bool is_place = f.name() != it->first;
      if (is_here(is_place ? f.schedule.hoist_level : f.schedule.store_level)) {
        if (!is_place) note_place(f, it->second, code.storage);
        Box box = simplified(it->second);
        stmt = is_place ? realize_place(f, box, stmt) : realize(f, box, stmt);
        it = code.storage.erase(it);
      } else {
        ++it;
      }
    }
    return stmt;
  }

  // ---- what is left at root ----

  void check_everything_found_its_place(const Emitted& all) const {
    for (const LoopedFunc& f : program_.funcs) {
      if (all.storage.count(place_name(f.name()))) check_place_found(program_, f);
      bool is_stored = all.storage.count(f.name());
      if (is_stored || all.uses.count(f.name())) check_found_its_place(program_, f, is_stored);
    }
  }
};

}  // namespace

LoopNests build_loop_nests(const Program& program, const LoopNestOptions& options) {
  return NestEmitter(program, options).emit();
}

}  // namespace retrograde::ir
