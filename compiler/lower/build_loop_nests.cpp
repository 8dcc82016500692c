#include "lower/build_loop_nests.h"

#include <algorithm>
#include <optional>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/emit_definition.h"
#include "lower/emitted.h"
#include "lower/extern_stage.h"
#include "lower/nest_checks.h"
#include "lower/nest_storage.h"
#include "lower/promised_bounds.h"
#include "lower/site.h"
#include "lower/specialize.h"
#include "lower/stage_nest.h"
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

class NestEmitter {
 public:
  NestEmitter(const Program& program, const LoopNestOptions& options)
      : program_(program),
        options_(options),
        values_(value_bounds(program)),
        storage_(program, options.slide) {
    for (size_t i = 0; i < program.funcs.size(); i++) note_site(static_cast<int>(i));
  }

  LoopNests emit() {
    LoopNests nests;
    Site root({});
    Emitted all = emit_site(root_, Emitted(), root);
    nests.bounds = std::move(root.bindings);
    all.stmt = storage_.realize_stored(
        all, [](const LoopLevel& level) { return level.kind == LoopLevel::Kind::Root; });
    check_everything_found_its_place(all);
    for (auto& [name, use] : all.uses)
      if (use.is_image) nests.images[name] = use;
    nests.body = all.stmt;
    nests.outputs = std::move(outputs_);
    storage_.report(nests);
    return nests;
  }

 private:
  const Program& program_;
  const LoopNestOptions options_;
  const ValueBounds values_;
  NestStorage storage_;
  std::vector<int> root_, innermost_;  // indices into program_.funcs, producers first
  std::map<std::pair<std::string, std::string>, std::vector<int>>
      at_;  // (consumer, loop) -> Funcs computed there
  std::map<std::string, Box> outputs_;

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
      if (piece.realized) stmt = storage_.realize(*piece.f, *piece.realized, stmt);
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
      made.stmt = storage_.fold(f, touched, loops, slides, code.has_vectors, site, made.stmt);
      if (f.schedule.async && !loops.empty())
        storage_.note_async_room(f, slides, site.touched(touched));
      if (is_stored_where_computed(f)) {
        piece.realized = allocated;
        storage_.note_place(f, allocated, code.storage);
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
        check_no_shared_storage(f, loop, storage_.stored_func(code.storage.begin()->first)->name());
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

  Emitted store_here(const LoopedFunc& f, int s, const Loop& loop, Emitted code) {
    if (code.storage.empty() || !storage_.is_site(f, loop)) return code;
    range_over_loops(code);
    code.stmt = storage_.realize_stored(code, [&](const LoopLevel& level) {
      return level.kind == LoopLevel::Kind::At && level.func == f.name() && level.var == loop.var &&
             (level.stage < 0 || level.stage == s);
    });
    return code;
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
