#include "autoschedule/epilogues.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>

#include "autoschedule/cost_estimate.h"
#include "autoschedule/hosted_funcs.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/read_estimate.h"
#include "autoschedule/start_in_tiles.h"
#include "autoschedule/stored_reads.h"
#include "frontend/language/func.h"
#include "frontend/schedule/loop_level.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/wrappers.h"
#include "ir/build.h"
#include "ir/lets.h"

namespace retrograde::autoschedule {

namespace {

constexpr double many_terms = 32;        // of a sum that strips would not take
constexpr double enough_terms = 8;       // of any
constexpr double terms_of_unknown = 16;  // of a loop whose extent is not known
constexpr double most_operations = 64;   // of the reader, of which a tile has many copies

// Whether a loop of the reduction moves along a dimension of its own of all that is read, as over channels or
// the inner dimension of a product; those of a stencil move along rows and columns of the result.
bool is_contraction(const FuncContents& f) {
  const Definition& update = f.updates[0];
  const auto uses_any = [](const Expr& e, const std::vector<std::string>& names) {
    return std::ranges::any_of(names, [&](const std::string& n) { return uses_variable(e, n); });
  };
  return std::ranges::any_of(update.rvars, [&](const ReductionVariable& r) {
    bool is_apart = true;
    walk_definition(update, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (!call || call->call_type == CallType::Operator || call->name == f.name) return;
      for (const Expr& index : call->args)
        is_apart &= !uses_variable(index, r.var) || !uses_any(index, f.args);
    });
    return is_apart;
  });
}

// Whether something that is in memory now could be computed in loops of f.
bool may_host(const FuncContents& f) {
  return std::ranges::any_of(direct_callees(f), [](const FuncPtr& callee) {
    const bool is_inlined = callee->schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined;
    return is_inlined ? may_host(*callee) : true;
  });
}

bool has_many_terms(const FuncContents& f) {
  return !f.updates.empty() && terms_of(f.updates[0], terms_of_unknown) >= many_terms;
}

// One update, whose tiles are added up each for itself.
bool is_sum_in_tiles(const FuncContents& f) {
  const bool is_partial = f.made && (f.made->lanes > 0 || f.made->has_parts || f.made->blocks > 0);
  return !is_partial && !f.is_extern() && f.updates.size() == 1 && has_tiles(f) &&
         terms_of(f.updates[0], terms_of_unknown) >= enough_terms;
}

// Whether strips could be better: the sum, or what reads the Func it ends in, would run in them.
bool is_for_strips(const FuncContents& sum, const FuncPtr& end, const StoredReads& reads) {
  if (has_many_terms(sum)) return !is_contraction(sum) && may_host(sum);
  return may_host(sum) || reads.is_hidden(end) ||
         !std::ranges::all_of(reads.of(end),
                              [](const StoredRead& by) { return has_many_terms(*by.reader); });
}

bool reads_the_same_place(const Reader& reader) {
  const std::vector<std::string>& args = reader.func->args;
  return std::ranges::all_of(reader.reads, [&](const Call* read) {
    return std::ranges::equal(read->args, args, [](const Expr& index, const std::string& arg) {
      const Expr place =
          unclamped(without_lets(index), [&](const Expr& e) { return uses_variable(e, arg); });
      const auto* variable = place.as<Variable>();
      return variable && variable->name == arg;
    });
  });
}

bool is_light(const FuncContents& f) {
  return operations_of_values(f.pure->values, [](const Call&) { return 1; }) <= most_operations;
}

// A loop of a sum over its tiles, as the reader will have it.
struct PassedLoop {
  std::string var;
  size_t dimension = 0;
  int64_t size = 0;      // of the parts that the dimension is cut into; 0: it is not cut
  bool is_part = false;  // runs over these
  bool is_parallel = false;
};

struct PassedLoops {
  std::vector<PassedLoop> loops;  // outermost first
  RegisterTile tile;
  bool is_whole = false;  // the tile's vectors are one loop
};

// nullopt: the reduction's loops do not lie between these and the tile.
std::optional<PassedLoops> passed_loops(const FuncContents& f, int lanes) {
  const std::vector<TileLoop> tiles = tile_loops(f, f.updates[0]);
  const std::vector<Dim>& dims = f.updates[0].schedule.dims;
  const auto is_inside = [](const Dim& loop) {
    return loop.is_reduction || loop.runs == ForType::Vectorized || loop.runs == ForType::Unrolled;
  };
  if (!std::all_of(dims.begin(), dims.end() - static_cast<long>(tiles.size()), is_inside))
    return std::nullopt;
  PassedLoops result;
  std::map<size_t, const Split*> held;  // by the dimension
  for (const TileLoop& tile : tiles) {
    PassedLoop loop{tile.loop.var, 0, 0, tile.loop.var != tile.dimension,
                    tile.loop.runs == ForType::Parallel};
    loop.dimension =
        static_cast<size_t>(std::ranges::find(f.args, tile.dimension) - f.args.begin());
    if (tile.split) {
      loop.size = as_const_int(tile.split->factor).value_or(0);
      if (loop.size < 1) return std::nullopt;
      held[loop.dimension] = tile.split;
    }
    if (loop.is_part) held.erase(loop.dimension);
    result.loops.push_back(std::move(loop));
  }
  for (const auto& [d, split] : held) {
    const int64_t size = *as_const_int(split->factor);
    if (d > 0)
      result.tile.sides.push_back({d, size});
    else if (size % lanes != 0)
      return std::nullopt;
    else
      result.tile.vectors = size / lanes;
  }
  const auto row = held.find(0);
  if (row == held.end()) return std::nullopt;
  if (const Split* phases = split_of_phases(f.updates[0], row->second->inner)) {
    result.tile.phases = as_const_int(phases->factor).value_or(1);
    result.tile.vectors /= result.tile.phases;
  }
  result.is_whole = std::ranges::any_of(dims, [&](const Dim& loop) {
    return loop.var == row->second->inner && loop.runs == ForType::Vectorized;
  });
  return result;
}

using LoopNames = std::map<std::string, std::string>;  // of the sum's loops: the reader's

// Gives the reader, whatever loops it has, those of the sum's tiles.
LoopNames give_passed_loops(const FuncPtr& reader, const PassedLoops& passed, int lanes) {
  graph::reset_loops(*reader);
  Stage stage(reader, 0);
  LoopNames names;
  std::map<size_t, std::string> parts;  // of dimensions; in the end of those in the tile
  std::vector<VarOrRVar> outside;       // innermost first
  for (const PassedLoop& loop : passed.loops) {
    std::string name = reader->args[loop.dimension];
    if (loop.is_part) {
      name = parts.at(loop.dimension);
      parts.erase(loop.dimension);
    } else if (loop.size > 0) {
      const std::string part = inner_loop(*reader, 0, name);
      stage.split(Var(name), Var(name), Var(part), static_cast<int>(loop.size),
                  TailStrategy::GuardWithIf);
      parts[loop.dimension] = part;
    }
    names[loop.var] = name;
    outside.insert(outside.begin(), Var(name));
  }
  std::vector<VarOrRVar> order;
  for (const auto& [d, part] : parts) order.emplace_back(Var(part));
  order.insert(order.end(), outside.begin(), outside.end());
  stage.reorder(order);
  const Var row(parts.at(0));
  if (passed.tile.vectors > 1 && !passed.is_whole) {
    const Var vector(new_loop(*reader, 0, "vector"));
    stage.split(row, row, vector, lanes).vectorize(vector).unroll(row);
  } else {
    stage.vectorize(row);
  }
  for (const auto& [d, part] : parts) {
    if (d > 0) stage.unroll(Var(part));
  }
  for (const PassedLoop& loop : passed.loops) {
    if (loop.is_parallel) stage.parallel(Var(names.at(loop.var)));
  }
  return names;
}

// Whether all that is computed in loops of the sum is computed in loops that the reader takes over.
bool may_move(const HostedFuncs& hosted, const FuncContents& sum, const PassedLoops& passed) {
  if (!hosted.are_computed_where_stored(sum)) return false;
  return std::ranges::all_of(hosted.computed_in(sum), [&](const FuncPtr& f) {
    const graph::LoopLevel& store = f->schedule.store_level;
    const std::string& loop = f->schedule.compute_level.var;
    const bool is_stored_apart = store.kind == graph::LoopLevel::Kind::At && store.var != loop;
    return !is_stored_apart && std::ranges::any_of(passed.loops, [&](const PassedLoop& each) {
      return each.var == loop;
    });
  });
}

void move(const std::vector<FuncPtr>& funcs, const FuncPtr& reader, const LoopNames& names) {
  for (const FuncPtr& f : funcs)
    Func(f).compute_at(Func(reader), Var(names.at(f->schedule.compute_level.var)));
}

}  // namespace

std::vector<FuncPtr> compute_epilogues(const std::vector<FuncPtr>& outputs, const Readers& readers,
                                       const std::vector<FuncPtr>& given,
                                       const std::unordered_set<const Symbol*>& but, int lanes,
                                       const GiveLoopsOfTile& give_loops) {
  const StoredReads reads(outputs);
  std::vector<FuncPtr> result;
  const auto is_free = [&](const FuncPtr& f) {
    return std::ranges::count(given, f) > 0 && is_at_root(*f) && !but.contains(f.get()) &&
           std::ranges::count(result, f) == 0;
  };
  for (const FuncPtr& sum : given) {
    if (!is_free(sum) || !readers.is_inside(sum) || readers.is_output(sum) ||
        !is_sum_in_tiles(*sum))
      continue;
    const auto reader = readers.only_reader(sum);
    if (!reader || !is_free(reader->func) || !has_plain_rows(*reader->func) ||
        !reads_the_same_place(*reader) || !is_light(*reader->func) ||
        is_for_strips(*sum, reader->func, reads))
      continue;
    const auto passed = passed_loops(*sum, lanes);
    const HostedFuncs hosted(outputs);
    if (!passed || !may_move(hosted, *sum, *passed)) continue;
    const LoopNames names = give_passed_loops(reader->func, *passed, lanes);
    move(hosted.computed_in(*sum), reader->func, names);
    give_loops(sum, passed->tile);
    Func(sum).compute_at(Func(reader->func), Var(names.at(passed->loops.back().var)));
    result.insert(result.end(), {sum, reader->func});
  }
  return result;
}

}  // namespace retrograde::autoschedule
