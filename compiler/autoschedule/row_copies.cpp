#include "autoschedule/row_copies.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "analysis/linear.h"
#include "autoschedule/cost_estimate.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/read_estimate.h"
#include "frontend/language/func.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/markers.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t copy_bytes = planning::second_cache_bytes / 16 * 3;
constexpr int64_t most_sharing_rows = 8;  // that share a copy
constexpr int64_t least_full_copies = 4;  // for one that holds fewer at the end
// Of loops whose extents are not known: elements of a row, channels and the like.
constexpr double unknown_row = 256, unknown_planes = 16;
constexpr double least_uses = 4;  // of an element of the copy

// Operations of an inlined value beside the load that a copy needs, too.
class InlinedCost {
 public:
  double of(const FuncContents& f) const {
    return std::max(0.0, operations(f) - 1) + (has_border(f) ? 1 : 0);
  }

 private:
  static FuncPtr inlined(const Call& call) {
    const FuncPtr callee = call.call_type == CallType::Func ? func_of(call) : nullptr;
    const bool is_inlined = callee && callee->is_pure() && !callee->is_extern() &&
                            callee->schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined;
    return is_inlined ? callee : nullptr;
  }
  // Each Func once: a value that many branches share is computed once.
  double operations(const FuncContents& f) const {
    std::unordered_set<const FuncContents*> seen;
    const std::function<double(const FuncContents&)> count = [&](const FuncContents& g) -> double {
      if (!seen.insert(&g).second) return 0;
      return operations_of_values(g.pure->values, [&](const Call& call) {
        const FuncPtr callee = inlined(call);
        return callee ? count(*callee) : 1;
      });
    };
    return count(f);
  }
  // Whether some index is more than a sum, as those of boundary conditions are.
  static bool has_border(const FuncContents& f) {
    bool found = false;
    const auto is_bent = [](const Expr& e) {
      const Kind kind = e.kind();
      return kind == Kind::Min || kind == Kind::Max || kind == Kind::Mod || kind == Kind::Select;
    };
    walk_definition(*f.pure, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (!call || call->call_type == CallType::Operator) return;
      const FuncPtr callee = inlined(*call);
      found = found || (callee && has_border(*callee));
      for (const Expr& index : call->args) found = found || any_node(without_lets(index), is_bent);
    });
    return found;
  }
};

// By how much an index moves with each variable, a quotient by its share.
using Steps = std::unordered_map<std::string, double>;

// Adds those of an expression, times the factor; false: it is neither linear nor a sum with quotients.
bool add_steps(const Expr& e, double factor, const std::vector<std::string>& names, Steps& steps) {
  const Sum form = analysis::linear_form(e);
  return form.valid && std::ranges::all_of(form.terms, [&](const Term& term) {
           const double share = factor * static_cast<double>(term.factor);
           const auto is_used = [&](const std::string& n) { return uses_variable(term.atom, n); };
           if (const auto* v = term.atom.as<Variable>()) {
             if (std::ranges::count(names, v->name) > 0) steps[v->name] += share;
             return true;
           }
           if (std::ranges::none_of(names, is_used))
             return !any_node(term.atom, [](const Call&) { return true; });
           const auto* quotient = term.atom.as<Div>();
           const auto divisor = quotient ? as_const_int(quotient->b) : std::nullopt;
           return divisor && *divisor > 0 &&
                  add_steps(quotient->a, share / static_cast<double>(*divisor), names, steps);
         });
}

// How one read moves with the loops of the tiles.
class ReadOfTiles {
 public:
  ReadOfTiles(const Call& call, const FuncContents& f, const RegisterTile& tile, int lanes,
              const LoopsOfTiles& loops, const SizeEstimate& sizes)
      : f_(f), tile_(tile), lanes_(lanes), loops_(loops), sizes_(sizes) {
    for (const Expr& arg : call.args) index_.push_back(place(arg));
  }

  // Along which rows lie: the innermost loop over tiles, but for that along rows, that moves the read.
  std::optional<size_t> row_dimension() const {
    const auto moves = [&](size_t d) { return d != 0 && is_moved_by(f_.args[d]); };
    const auto found = std::find_if(loops_.tiles.begin(), loops_.tiles.end(), moves);
    return found == loops_.tiles.end() ? std::nullopt : std::optional(*found);
  }

  // Of one copy for so many tiles along that dimension.
  struct Counts {
    double elements = 1;
    double reads = 1;
    bool is_known = true;  // no extent was guessed
  };
  // nullopt: an index has other terms than multiples and quotients, or rows are not those of the source.
  std::optional<Counts> counts(size_t row, int64_t rows) const {
    Counts counts;
    const Extents extents = extents_of(row, rows, counts.is_known);
    std::vector<std::string> names;
    for (const auto& [name, extent] : extents) names.push_back(name);
    for (const Expr& index : index_) {
      Steps steps;
      if (!add_steps(index, 1, names, steps)) return std::nullopt;
      double span = 1;
      for (const auto& [name, step] : steps) {
        if (name == f_.args[0] && step != 0 && &index != &index_[0]) return std::nullopt;
        span += std::abs(step) * (extents.at(name) - 1);
      }
      counts.elements *= span;
    }
    if (!uses_variable(index_[0], f_.args[0])) return std::nullopt;
    for (const auto& [name, extent] : extents) counts.reads *= extent;
    for (const RegisterTile::Side& side : tile_.sides) {
      if (!is_moved_by(f_.args[side.dimension])) counts.reads /= static_cast<double>(side.size);
    }
    return counts;
  }

  // That have a copy of their own, if one is of so many tiles; 0: not known.
  double copies(size_t row, int64_t rows) const {
    double copies = 1;
    for (const size_t d : loops_.tiles) {
      if (d == 0 || !is_moved_by(f_.args[d])) continue;
      const auto size = static_cast<double>(tile_.size_along(d, lanes_) * (d == row ? rows : 1));
      copies *= std::ceil(static_cast<double>(sizes_.extent(f_, d).value_or(0)) / size);
    }
    return copies;
  }

  // Whether the rows of a copy are few, whatever the sizes: those of a stencil.
  bool is_a_window(size_t row) const {
    const std::string& var = f_.args[row];
    return std::any_of(index_.begin(), index_.end(), [&](const Expr& index) {
      return uses_variable(index, var) && std::any_of(update().rvars.begin(), update().rvars.end(),
                                                      [&](const ReductionVariable& r) {
                                                        return uses_variable(index, r.var) &&
                                                               as_const_int(simplify(r.extent));
                                                      });
    });
  }

 private:
  using Extents = std::unordered_map<std::string, double>;

  const Definition& update() const { return f_.updates[0]; }
  bool is_moved_by(const std::string& var) const {
    return std::any_of(index_.begin(), index_.end(),
                       [&](const Expr& e) { return uses_variable(e, var); });
  }
  Expr place(const Expr& arg) const {
    return unclamped(without_lets(arg), [&](const Expr& e) {
      const auto is_used = [&](const std::string& var) { return uses_variable(e, var); };
      return std::ranges::any_of(f_.args, is_used) ||
             std::any_of(update().rvars.begin(), update().rvars.end(),
                         [&](const ReductionVariable& r) { return is_used(r.var); });
    });
  }

  // While one copy is in use. Dimensions that neither move the read nor stand inside of the copy's
  // loop count as one tile.
  Extents extents_of(size_t row, int64_t rows, bool& is_known) const {
    Extents extents;
    const auto add_all = [&](size_t d) {
      const auto tile = static_cast<double>(tile_.size_along(d, lanes_));
      const auto extent = sizes_.extent(f_, d);
      const double guess = d == 0 ? unknown_row : std::max(unknown_planes, tile);
      is_known &= extent.has_value();
      extents[f_.args[d]] =
          std::ceil((extent ? static_cast<double>(*extent) : guess) / tile) * tile;
    };
    for (const size_t d : loops_.inside) add_all(d);
    bool is_inside = true;
    for (const size_t d : loops_.tiles) {
      is_inside &= d != row;
      if (is_inside)
        add_all(d);
      else
        extents[f_.args[d]] =
            static_cast<double>(tile_.size_along(d, lanes_) * (d == row ? rows : 1));
    }
    for (const ReductionVariable& r : update().rvars) {
      const auto extent = as_const_int(simplify(r.extent));
      is_known &= extent.has_value();
      extents[r.var] = extent ? static_cast<double>(*extent) : unknown_planes;
    }
    return extents;
  }

  const FuncContents& f_;
  const RegisterTile& tile_;
  const int lanes_;
  const LoopsOfTiles& loops_;
  const SizeEstimate& sizes_;
  std::vector<Expr> index_;
};

FuncPtr inlined_source(const Call& call) {
  const FuncPtr source = call.call_type == CallType::Func ? func_of(call) : nullptr;
  const bool is_free = source && source->is_pure() && !source->is_extern() &&
                       !has_directives(*source) && !source->args.empty() &&
                       source->schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined;
  return is_free ? source : nullptr;
}

// Whether the read needs no border of the source: where its elements lie, as far as sizes are known, the
// condition has one outcome. A copy of these saves little.
bool is_inside(const Call& call, const FuncContents& source, const FuncContents& f,
               const SizeEstimate& sizes) {
  simplification::BoundsMap bounds;
  for (size_t d = 0; d < f.args.size(); ++d) bounds[f.args[d]] = sizes.range(f, d);
  for (const ReductionVariable& r : f.updates[0].rvars)
    bounds[r.var] = {simplify(r.min), simplify(r.min + r.extent - 1)};
  Substitution places;
  for (size_t d = 0; d < source.args.size(); ++d)
    places[source.args[d]] = without_likely(without_lets(call.args[d]));
  return std::ranges::all_of(source.pure->values, [&](const Expr& value) {
    const auto* choice = value.as<Select>();
    if (!choice) return false;
    const Expr here = substitute(without_likely(choice->condition), places);
    return can_prove(here, bounds) || can_prove(!here, bounds);
  });
}

bool pays(const ReadOfTiles::Counts& counts, double operations) {
  const double uses = counts.reads / counts.elements;
  return uses >= least_uses && uses * operations >= planning::cache_trip_operations;
}

std::optional<RowCopy> copy_for(const Call& call, const FuncPtr& source, const FuncContents& f,
                                const RegisterTile& tile, int lanes, const LoopsOfTiles& loops,
                                const SizeEstimate& sizes) {
  const double operations = InlinedCost().of(*source);
  if (operations <= 0 || is_inside(call, *source, f, sizes)) return std::nullopt;
  const ReadOfTiles read(call, f, tile, lanes, loops, sizes);
  const auto row = read.row_dimension();
  if (!row) return std::nullopt;
  double bytes = 0;  // of an element
  for (const Type& type : source->types) bytes += type.bytes();
  const auto extent = sizes.extent(f, *row);
  const bool may_share = loops.inside.empty() && tile.size_along(*row, lanes) == 1;
  for (int64_t rows = may_share ? most_sharing_rows : 1; rows >= 1; rows /= 2) {
    const auto counts = read.counts(*row, rows);
    if (!counts) return std::nullopt;
    const bool fits =
        counts->is_known && extent && (*extent % rows == 0 || *extent >= least_full_copies * rows);
    const bool leaves_tasks =
        read.copies(*row, rows) >= static_cast<double>(sizes.machine().enough_tasks());
    if (rows > 1 && (!fits || !leaves_tasks || counts->elements * bytes > copy_bytes)) continue;
    const bool is_small =
        counts->is_known ? counts->elements * bytes <= 2 * copy_bytes : read.is_a_window(*row);
    return is_small && pays(*counts, operations) ? std::optional(RowCopy{source, *row, rows})
                                                 : std::nullopt;
  }
  return std::nullopt;
}

bool reads(const Definition& stage, const FuncPtr& source) {
  bool found = false;
  walk_definition(stage, [&](const Expr& e) {
    const auto* call = e.as<Call>();
    found = found || (call && call->symbol.raw() == source.get());
  });
  return found;
}

}  // namespace

std::optional<RowCopy> row_copy(const FuncContents& f, const RegisterTile& tile, int lanes,
                                const LoopsOfTiles& loops, const SizeEstimate& sizes) {
  if (f.updates.size() != 1) return std::nullopt;
  std::unordered_map<const Symbol*, int> reads_of;
  std::optional<RowCopy> result;
  walk_definition(f.updates[0], [&](const Expr& e) {
    const auto* call = e.as<Call>();
    const FuncPtr source = call ? inlined_source(*call) : nullptr;
    if (!source) return;
    ++reads_of[source.get()];
    if (!result && !reads(*f.pure, source))
      result = copy_for(*call, source, f, tile, lanes, loops, sizes);
  });
  // Of several reads the copy would hold what lies between them.
  return result && reads_of[result->source.get()] == 1 ? result : std::nullopt;
}

void copy_rows(const FuncPtr& f, const RowCopy& copy, const retrograde::LoopLevel& loop,
               int lanes) {
  Func rows = Func(copy.source).in(Func(f));
  rows.compute_at(loop);
  vectorize(Stage(rows.function(), 0), rows.args()[0], lanes, TailStrategy::GuardWithIf);
}

}  // namespace retrograde::autoschedule
