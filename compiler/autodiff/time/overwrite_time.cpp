#include "autodiff/time/overwrite_time.h"

#include "autodiff/time/time_axis.h"
#include "autodiff/updates/versions.h"
#include "diagnostics/error.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "graph/definitions/own_reads.h"
#include "graph/function.h"
#include "ir/build.h"
#include "ir/print.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

Expr slot_of(const Expr& time, const TimeAxis& axis) {
  return simplify(binary(Kind::Mod, time, make_const(Int(32), axis.slots)));
}

class Folder {
 public:
  Folder(const Seeds& seeds, const SynthesisOptions& options)
      : outputs_(outputs_of(seeds)),
        order_(topological_order(outputs_)),
        regions_(order_, regions_of(seeds)),
        ranges_(order_),
        options_(options) {}

  const std::vector<FuncPtr>& order() const { return order_; }
  std::map<const Symbol*, FuncPtr> copies;  // copies of Funcs that read folded ones
  std::vector<Explanation> explanations;

  void run() {
    for (const FuncPtr& f : order_) {
      if (f->custom_derivatives || f->is_extern()) return;  // rules refer to the original Funcs
    }
    for (const FuncPtr& f : order_) {
      if (!fold(f)) copy_if_changed(f);
    }
  }

 private:
  using Read = std::function<Expr(const Call& call, const std::vector<Expr>& args)>;

  // ---- one loop ----

  bool fold(const FuncPtr& f) {
    const bool is_requested = options_.only_requested && options_.requested.contains(f.get());
    const bool is_output = std::ranges::find(outputs_, f) != outputs_.end();
    if (is_requested || is_output || f->updates.empty()) return false;
    const int stage = f->stage_count() - 1;
    const AdjointTarget target{f->name, f->args, {}, {}};
    const AdjointFunc none;
    VersionBudget nothing({.keep = VersionRules::Keep::Never});
    const UpdateQuery query{f,       stage, regions_,
                            target,  none,  false,
                            nothing, {},    [](const Expr&) { return false; },
                            ranges_};
    const UpdateContext c(query);
    auto axis = find_time_axis(c, order_);
    if (!axis) return false;
    FuncPtr start = clone(f, stage, f->name + "_start");
    FuncPtr pure = stage > 1 ? clone(f, 1, f->name + "_unwritten") : start;
    FuncPtr folded = make_folded(c, *axis, start, pure);
    replaced_[f.get()] = [=](const Call& call, const std::vector<Expr>& args) {
      return read_at_end(call, args, *f, *axis, folded, pure);
    };
    explanations.push_back({Explanation::Kind::Version, f->name,
                            text("only its last steps are read: ", quoted(folded->name), " keeps ",
                                 axis->slots, axis->slots == 1 ? " of them" : " of them in turn",
                                 " and has the adjoint; ", quoted(f->name), " has none")});
    return true;
  }

  FuncPtr make_folded(const UpdateContext& c, const TimeAxis& axis, const FuncPtr& start,
                      const FuncPtr& pure) const {
    FuncPtr folded = make_func(Role::TimeFold, c.f->name + "_folded", c.f->name);
    std::vector<Expr> at_start = c.point;
    at_start[axis.dim] = time_at_start(c.point[axis.dim], axis);
    define_pure(folded, c.point, values_of(start, at_start));

    const std::vector<Expr> reads = c.self_reads();
    const Read in_loop = [&](const Call& call, const std::vector<Expr>& args) {
      auto same = [&](const Expr& read) {
        return same_args(as_call_of(read, c.f)->args, call.args);
      };
      auto i = std::ranges::find_if(reads, same) - reads.begin();
      return chosen(axis.in_slot[static_cast<size_t>(i)], call.component, args, axis, folded, pure);
    };
    const auto here = [&](const Expr& e) { return redirected(e, c.f, in_loop); };
    std::vector<Expr> place = mapped(c.write, here);
    place[axis.dim] = slot_of(place[axis.dim], axis);
    append_update(folded, place, mapped(c.values, here), c.definition.rvars,
                  here(c.definition.predicate));
    return folded;
  }

  // The last time before the first step that belongs in the slot; no further back than a step reads.
  static Expr time_at_start(const Expr& slot, const TimeAxis& axis) {
    Expr last = axis.first - axis.sign;
    Expr back = slot_of(axis.sign > 0 ? last - slot : slot - last, axis);
    return simplify(last - min(back, axis.lag - 1) * axis.sign);
  }

  // f at `args`: from its slot if `in_slot` holds, else from the pure definition.
  static Expr chosen(const Expr& in_slot, int k, std::vector<Expr> args, const TimeAxis& axis,
                     const FuncPtr& folded, const FuncPtr& pure) {
    Expr unwritten = call_value(pure, args, k);
    args[axis.dim] = slot_of(args[axis.dim], axis);
    Expr kept = call_value(folded, args, k);
    if (is_const_true(in_slot)) return kept;
    return is_const_false(in_slot) ? unwritten : make_select(in_slot, kept, unwritten);
  }
  static Expr read_at_end(const Call& call, const std::vector<Expr>& args, const FuncContents& f,
                          const TimeAxis& axis, const FuncPtr& folded, const FuncPtr& pure) {
    Substitution place;
    for (size_t d = 0; d < args.size(); ++d) place[f.args[d]] = args[d];
    Expr before = axis.sign > 0 ? args[axis.dim] < axis.first : args[axis.dim] > axis.first;
    Expr in_slot = simplify(substitute(axis.ever_written, place));
    if (!is_const_true(in_slot)) in_slot = simplify(before) || in_slot;
    return chosen(in_slot, call.component, args, axis, folded, pure);
  }

  // ---- consumers ----

  // Redirects reads of folded and copied Funcs; `read` replaces those of `own`.
  Expr redirected(const Expr& e, const FuncContents* own = nullptr, const Read& read = {}) const {
    return map_func_calls(e, [&](const Call& call, const std::vector<Expr>& args) {
      if (own && call.symbol.raw() == own) return read(call, args);
      auto found = replaced_.find(call.symbol.raw());
      return found == replaced_.end() ? Expr() : found->second(call, args);
    });
  }

  // A copy of the first stages of f.
  FuncPtr clone(const FuncPtr& f, int stages, const std::string& name) const {
    return clone_prefix(f, stages, name, Role::TimeFold,
                        [&](const Expr& e) { return redirected(e); });
  }

  void copy_if_changed(const FuncPtr& f) {
    bool changed = false;
    for_each_expr(*f, [&](const Expr& e) { changed |= !redirected(e).same_as(e); });
    if (!changed) return;
    FuncPtr g = clone(f, f->stage_count(), f->name);
    copies[f.get()] = g;
    replaced_[f.get()] = [g](const Call& call, const std::vector<Expr>& args) {
      return call_value(g, args, call.component);
    };
  }

  std::vector<FuncPtr> outputs_, order_;
  Regions regions_;
  ValueRanges ranges_;
  const SynthesisOptions& options_;
  std::unordered_map<const Symbol*, Read> replaced_;
};

}  // namespace

SynthesisResult synthesize_folded(const Seeds& seeds, SynthesisOptions options) {
  Folder folder(seeds, options);
  folder.run();
  if (folder.copies.empty()) return synthesize_adjoints(seeds, options);
  const Seeds copied = mapped(seeds, [&](const Seed& seed) {
    return Seed{value_or(folder.copies, seed.output.get(), seed.output), seed.region, seed.values};
  });
  for (const auto& [f, copy] : folder.copies) {
    if (options.requested.erase(f) > 0) options.requested.insert(copy.get());
  }
  SynthesisResult result = synthesize_adjoints(copied, options);
  for (const auto& [f, copy] : folder.copies) {
    for (int s = 0; s < copy->stage_count(); ++s) {
      auto found = result.after_stage.find({copy.get(), s});
      if (found != result.after_stage.end()) result.after_stage[{f, s}] = found->second;
    }
  }
  for (size_t i = 0; i < seeds.size(); ++i) result.outputs[i].func = seeds[i].output;
  result.explanations.insert(result.explanations.begin(), folder.explanations.begin(),
                             folder.explanations.end());
  return result;
}

}  // namespace retrograde::autodiff
