#include "autoschedule/look_ups.h"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "autoschedule/new_loop.h"
#include "frontend/language/rdom.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

constexpr size_t fewest_look_ups = 2;
constexpr int64_t few_planes = 4, planes_at_once = 2;
constexpr int64_t rows_of_a_block = 32;
constexpr int64_t many_terms = 8;  // planes that are worth blocks of sums

bool is_decided_by_data(const Expr& place) { return reads_memory(place, MemoryReads::Functions); }

// The indices of each different read at such a place.
std::vector<std::vector<Expr>> look_ups_of(const FuncContents& f, const Definition& stage) {
  std::vector<std::vector<Expr>> result;
  for (const Expr& value : stage.values) {
    walk(without_lets(value), [&](const Expr& e) {
      const auto* call = e.as<Call>();
      const bool reads = call && call->call_type != CallType::Operator && call->symbol.raw() != &f;
      if (!reads || !std::any_of(call->args.begin(), call->args.end(), is_decided_by_data))
        return true;
      const bool is_known = std::any_of(result.begin(), result.end(), [&](const auto& other) {
        return same_args(call->args, other);
      });
      if (!is_known) result.push_back(call->args);
      return true;
    });
  }
  return result;
}

// Whether the variable numbers planes: it is an index of every read, and moves no place.
bool numbers_planes(const std::vector<std::vector<Expr>>& look_ups, const std::string& var) {
  return std::all_of(look_ups.begin(), look_ups.end(), [&](const std::vector<Expr>& indices) {
    bool is_index = false, moves = false;
    for (const Expr& index : indices) {
      const auto* variable = index.as<Variable>();
      is_index |= variable && variable->name == var;
      moves |= is_decided_by_data(index) && uses_variable(index, var);
    }
    return is_index && !moves;
  });
}

// Whether planes by the variable have the same value of each read: neither places nor planes of these
// depend on it.
bool leaves_alone(const std::vector<std::vector<Expr>>& look_ups, const std::string& var) {
  return std::none_of(look_ups.begin(), look_ups.end(), [&](const std::vector<Expr>& indices) {
    return std::any_of(indices.begin(), indices.end(),
                       [&](const Expr& index) { return uses_variable(index, var); });
  });
}

// The loop over planes, and how many there are.
struct Planes {
  VarOrRVar loop;
  int64_t count;
};

std::optional<Planes> pure_planes(const FuncContents& f, const Definition& stage,
                                  const std::vector<std::vector<Expr>>& look_ups,
                                  const SizeEstimate& sizes) {
  for (size_t d = 1; d < f.args.size(); ++d) {
    const auto count = sizes.extent(f, d);
    if (!count || *count <= 1 || !is_pure_position(f, stage, d)) continue;
    // One value for all planes pays by itself, where they are few.
    const bool shares_places =
        look_ups.size() >= fewest_look_ups && numbers_planes(look_ups, f.args[d]);
    if (shares_places || (*count <= few_planes && leaves_alone(look_ups, f.args[d])))
      return Planes{Var(f.args[d]), *count};
  }
  return std::nullopt;
}

std::optional<Planes> summed_planes(const Definition& stage,
                                    const std::vector<std::vector<Expr>>& look_ups) {
  if (stage.rvars.size() != 1) return std::nullopt;
  const ReductionVariable& r = stage.rvars[0];
  const auto count = as_const_int(r.extent);
  const bool is_long = count && *count >= many_terms;
  return is_long && numbers_planes(look_ups, r.var) ? std::optional(Planes{RVar(r.var), *count})
                                                    : std::nullopt;
}

bool is_pure_everywhere(const FuncContents& f, const Definition& stage) {
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (!is_pure_position(f, stage, d)) return false;
  }
  return true;
}

class PlaneLoops {
 public:
  PlaneLoops(const FuncContents& f, int index, Stage& stage, int lanes)
      : f_(f), index_(index), stage_(stage), lane_(inside(Var(f.args[0]))) {
    const Var row(f.args[0]);
    stage_.split(row, row, lane_, lanes, TailStrategy::GuardWithIf).vectorize(lane_);
  }

  // Elements: planes at once inside of the pixels, other planes where they stand. The outermost loops
  // may be short.
  void give_elements(const Planes& planes, const SizeEstimate& sizes) {
    std::vector<VarOrRVar> order{lane_, some_of(planes)};
    for (const std::string& arg : f_.args) order.push_back(Var(arg));
    stage_.reorder(order);
    int64_t iterations = 1;
    for (size_t d = f_.args.size(); d-- > 1 && iterations < sizes.machine().enough_tasks();) {
      const int64_t extent = sizes.extent(f_, d).value_or(sizes.machine().enough_tasks());
      iterations *= f_.args[d] == planes.loop.name() ? extent / at_once(planes) : extent;
      stage_.parallel(Var(f_.args[d]));
    }
  }

  // Terms: the other planes outside of a block of rows.
  void give_terms(const Planes& planes, int64_t rows) {
    const Var y(f_.args[1]);
    const VarOrRVar in_block = inside(y);
    stage_.split(y, y, in_block, static_cast<int>(rows), TailStrategy::GuardWithIf);
    std::vector<VarOrRVar> order{lane_, some_of(planes), Var(f_.args[0]), in_block, planes.loop, y};
    for (size_t d = 2; d < f_.args.size(); ++d) order.push_back(Var(f_.args[d]));
    stage_.reorder(order);
    for (size_t d = 1; d < f_.args.size(); ++d) stage_.parallel(Var(f_.args[d]));
  }

 private:
  VarOrRVar inside(const VarOrRVar& loop) const {
    const std::string name = inner_loop(f_, index_, loop.name());
    return loop.is_rvar ? VarOrRVar(RVar(name)) : VarOrRVar(Var(name));
  }
  static int at_once(const Planes& planes) {
    return static_cast<int>(planes.count <= few_planes ? planes.count : planes_at_once);
  }
  VarOrRVar some_of(const Planes& planes) {
    const VarOrRVar some = inside(planes.loop);
    stage_.split(planes.loop, planes.loop, some, at_once(planes), TailStrategy::GuardWithIf)
        .unroll(some);
    return some;
  }

  const FuncContents& f_;
  const int index_;
  Stage& stage_;
  const VarOrRVar lane_;
};

}  // namespace

bool schedule_look_ups(const FuncContents& f, int index, Stage& stage, int lanes,
                       const SizeEstimate& sizes) {
  const Definition& definition = f.stage(index);
  if (f.args.size() < 2 || !is_pure_everywhere(f, definition)) return false;
  const auto look_ups = look_ups_of(f, definition);
  if (look_ups.empty()) return false;
  if (definition.rvars.empty()) {
    const auto planes = pure_planes(f, definition, look_ups, sizes);
    if (planes) PlaneLoops(f, index, stage, lanes).give_elements(*planes, sizes);
    return planes.has_value();
  }
  if (look_ups.size() < fewest_look_ups) return false;
  const auto planes = summed_planes(definition, look_ups);
  const auto rows = sizes.extent(f, 1);
  if (!planes || !rows) return false;
  PlaneLoops(f, index, stage, lanes)
      .give_terms(*planes,
                  std::clamp<int64_t>(*rows / sizes.machine().enough_tasks(), 1, rows_of_a_block));
  return true;
}

}  // namespace retrograde::autoschedule
