#include "autoschedule/register_tile.h"

#include <algorithm>
#include <cstdlib>
#include <unordered_set>

#include "analysis/linear.h"
#include "autoschedule/cost_estimate.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/loop_order.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/phase_loops.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

using planning::core;

constexpr int64_t most_values = 4;    // of a long dimension, or an unknown one: rests run slower
constexpr int64_t small_side = 16;    // a dimension that may lie in registers whole
constexpr int64_t most_of_known = 8;  // of a dimension that it divides: there are no rests
constexpr double worth_while = 0.8;   // of the cycles without a tile
constexpr double a_rest = 1.03;       // of the cycles
constexpr double rows_apart = 1.1;    // of the cycles: vectors of several images, say
constexpr int64_t most_parts = 4;     // of a vector that is loaded whole: then it is gathered
constexpr double phases_apart = 1.3;  // the same of phases, which read a copy of rows several times

// What an iteration of a reduction loads, by the dimensions that the place depends on.
struct Operand {
  std::vector<bool> depends_on;  // by dimension
  std::vector<bool> is_apart;    // by dimension: a step goes to what no iteration reads beside
  bool is_far = false;           // each iteration reads other rows
  bool is_of_phase = false;      // one element for all lanes of a phase
  double parts = 1;              // that a vector is loaded in: its elements are so far apart
};

// Whether an index grows by a cache line or more in each iteration of a loop, as the hop of overlapping windows.
bool steps_over_lines(const Expr& index, const std::string& loop) {
  const auto form = analysis::decompose(index, {loop});
  return form && std::abs(form->coefficients[0].second) >= planning::line_elements;
}

// Whether what moves the read moves it from row to row or by cache lines, not along one.
bool walks_afar(const Call& call, const Definition& stage) {
  bool moves = false, is_far = true;
  for (const ReductionVariable& r : stage.rvars) {
    for (size_t d = call.args.size(); d-- > 0;) {
      if (!uses_variable(call.args[d], r.var)) continue;
      moves = true;
      is_far &= d > 0 || steps_over_lines(call.args[d], r.var);
    }
  }
  return moves && is_far;
}

bool moves_in(const Definition& stage, const Expr& index) {
  return std::ranges::any_of(
      stage.rvars, [&](const ReductionVariable& r) { return uses_variable(index, r.var); });
}

// The loads of a vector of a row whose elements are a few apart.
double parts_of_vector(const Call& call, const std::string& lanes, int64_t phases) {
  const auto stride = growth_of_index(call.args[0], lanes, phases);
  return stride && *stride > 1 && *stride <= most_parts ? static_cast<double>(*stride) : 1;
}

// Whether a vector along these variables loads its lanes from different rows. What is computed inline loads for itself.
bool gathers_along(const Call& call, const std::vector<std::string>& variables) {
  const auto moves = [&](const Expr& index) {
    return std::ranges::any_of(variables,
                               [&](const std::string& name) { return uses_variable(index, name); });
  };
  if (std::ranges::none_of(call.args, moves)) return false;
  const FuncPtr callee = call.call_type == CallType::Func ? func_of(call) : nullptr;
  if (!callee || !is_computed_inline(callee, {}))
    return !moves(call.args[innermost_dimension(call)]);
  std::vector<std::string> inside;
  for (size_t d = 0; d < call.args.size(); ++d) {
    if (moves(call.args[d])) inside.push_back(callee->args[d]);
  }
  bool result = false;
  walk_definition(*callee->pure, [&](const Expr& e) {
    const auto* read = e.as<Call>();
    result |= read && read->call_type != CallType::Operator && gathers_along(*read, inside);
  });
  return result;
}
// Lanes of private sums are terms, which nothing packs.
bool gathers_terms(const FuncContents& f, const Call& call) {
  return f.made && f.made->lanes > 0 && gathers_along(call, {f.args[0]});
}

// nullopt: the update reads other elements of its own.
std::optional<std::vector<Operand>> operands_of(const FuncContents& f, const Definition& stage,
                                                int64_t phases) {
  std::vector<Operand> operands;
  bool is_plain = true;
  std::unordered_set<const ExprNode*> seen;
  const auto note = [&](const Expr& e) {
    if (!seen.insert(e.get()).second) return false;
    const auto* call = e.as<Call>();
    const bool loads =
        call && (call->call_type == CallType::Func || call->call_type == CallType::Image);
    if (!loads) return true;
    if (call->call_type == CallType::Func && call->name == f.name) {  // or a copy of it
      is_plain &= same_args(call->args, stage.args);
      return false;
    }
    Operand operand{{}, {}, walks_afar(*call, stage)};
    for (const std::string& arg : f.args) {
      const auto moves = [&](const Expr& index) { return uses_variable(index, arg); };
      operand.depends_on.push_back(std::ranges::any_of(call->args, moves));
      operand.is_apart.push_back(std::ranges::any_of(
          call->args, [&](const Expr& index) { return moves(index) && !moves_in(stage, index); }));
    }
    operand.is_of_phase = phases > 1 && operand.depends_on[0] &&
                          std::ranges::all_of(call->args, [&](const Expr& index) {
                            return growth_of_index(index, f.args[0], phases) == 0;
                          });
    if (operand.is_of_phase) operand.depends_on[0] = false;
    if (operand.depends_on[0])
      operand.parts =
          gathers_terms(f, *call) ? f.made->lanes : parts_of_vector(*call, f.args[0], phases);
    operands.push_back(std::move(operand));
    return true;
  };
  for (const Expr& value : stage.values) walk(value, note);
  return is_plain ? std::optional(operands) : std::nullopt;
}

int64_t sums_of(const RegisterTile& tile) {
  int64_t sums = tile.vectors * tile.phases;
  for (const RegisterTile::Side& side : tile.sides) sums *= side.size;
  return sums;
}

// In one iteration of the reduction: an operand once for all of the tile that it does not depend on.
// Of registers that lie next to each other only the first comes from afar. `registers`: of a vector.
double loads_of(const RegisterTile& tile, const std::vector<Operand>& operands, double registers) {
  double loads = 0;
  for (const Operand& operand : operands) {
    const double first = operand.is_far ? core.far_row_loads : core.unaligned_loads;
    const double vectors = registers * operand.parts * static_cast<double>(tile.vectors);
    double count = operand.depends_on[0] ? first + core.unaligned_loads * (vectors - 1) : 1;
    if (operand.depends_on[0] || operand.is_of_phase) count *= static_cast<double>(tile.phases);
    for (const RegisterTile::Side& side : tile.sides)
      count *= operand.depends_on[side.dimension] ? static_cast<double>(side.size) : 1;
    loads += count;
  }
  return loads;
}

// Whether something that is loaded is used more than once in the tile.
bool shares_loads(const RegisterTile& tile, const std::vector<Operand>& operands) {
  const auto is_shared = [&](const Operand& operand) {
    return !operand.depends_on[0] ||
           std::any_of(tile.sides.begin(), tile.sides.end(), [&](const RegisterTile::Side& side) {
             return !operand.depends_on[side.dimension];
           });
  };
  return std::any_of(operands.begin(), operands.end(), is_shared);
}

// Whether vectors of one operand come from several images at once, or the like. Their lines may meet in one
// set of a cache, and loops over them do not stand where a copy of their rows (row_copies.h) would.
bool reads_rows_apart(const RegisterTile& tile, const std::vector<Operand>& operands) {
  return std::ranges::any_of(operands, [&](const Operand& operand) {
    return operand.depends_on[0] &&
           std::ranges::any_of(tile.sides, [&](const RegisterTile::Side& side) {
             return operand.is_apart[side.dimension];
           });
  });
}

// That the functions of a term take, of which nothing is shared.
double adds_of_functions(const Definition& stage) {
  double adds = 0;
  std::unordered_set<const ExprNode*> seen;
  for (const Expr& value : stage.values) {
    walk(value, [&](const Expr& e) {
      if (!seen.insert(e.get()).second) return false;
      adds += work_of(e).function_adds;
      return true;
    });
  }
  return adds;
}

// For each product of a register.
double cycles(const RegisterTile& tile, const std::vector<Operand>& operands, double adds,
              double registers) {
  const double sums = registers * static_cast<double>(sums_of(tile));
  return std::max({loads_of(tile, operands, registers) / sums / core.loads_per_cycle,
                   (1 + adds) / core.products_per_cycle, core.float_latency / sums});
}

// Iterations of the tile for each that has an element; a rest has its own loops.
double iterations_an_element(const RegisterTile& tile, int lanes, const FuncContents& f,
                             const SizeEstimate& sizes) {
  const auto lost = [&](size_t dimension, int64_t size) {
    const auto extent = sizes.extent(f, dimension);
    if (!extent || *extent <= 0) return 1.0;
    const int64_t all = (*extent + size - 1) / size * size;
    return (all == *extent ? 1 : a_rest) * static_cast<double>(all) / static_cast<double>(*extent);
  };
  double result = lost(0, tile.phases * tile.vectors * lanes);
  for (const RegisterTile::Side& side : tile.sides) result *= lost(side.dimension, side.size);
  return result;
}

// How much of a dimension a tile may have.
std::vector<int64_t> sizes_of_side(const FuncContents& f, size_t dimension,
                                   const SizeEstimate& sizes) {
  std::vector<int64_t> result;
  const auto extent = sizes.extent(f, dimension);
  if (extent && *extent <= small_side) {
    for (int64_t size = 2; size <= *extent; ++size) result.push_back(size);
  } else {
    const bool divides = extent && *extent % most_of_known == 0;
    const int64_t most = divides ? most_of_known : most_values;
    for (int64_t size = 2; size <= most; size *= 2) result.push_back(size);
  }
  return result;
}

}  // namespace

std::optional<RegisterTile> register_tile(const FuncContents& f, const Definition& stage, int lanes,
                                          int64_t vectors, const planning::Machine& machine,
                                          const SizeEstimate& sizes, int64_t phases) {
  const auto moves = [&](const Expr& arg) {
    return std::any_of(stage.rvars.begin(), stage.rvars.end(),
                       [&](const ReductionVariable& r) { return uses_variable(arg, r.var); });
  };
  if (stage.rvars.empty() || std::any_of(stage.args.begin(), stage.args.end(), moves))
    return std::nullopt;
  const auto operands = operands_of(f, stage, phases);
  if (!operands || operands->empty()) return std::nullopt;
  int64_t bytes = 0;
  for (const Type& type : f.types) bytes += type.bytes() * lanes;
  std::vector<size_t> sides;  // the last first: channels are, where they are no lanes
  const size_t numbers = f.made ? f.made->blocks : 0;  // of blocks, of which one is at hand
  for (size_t d = f.args.size() - numbers; d-- > 1;) {
    if (is_pure_position(f, stage, d)) sides.push_back(d);
  }
  const double adds = adds_of_functions(stage);
  const int64_t vector_bytes = lanes * f.types[0].bytes();
  const double registers =
      std::max(1.0, static_cast<double>(vector_bytes) / static_cast<double>(machine.vector_bytes));
  RegisterTile best;
  const auto cost = [&](const RegisterTile& tile) {
    return cycles(tile, *operands, adds, registers) * iterations_an_element(tile, lanes, f, sizes) *
           (!reads_rows_apart(tile, *operands) ? 1
            : phases > 1                       ? phases_apart
                                               : rows_apart);
  };
  double least = cost(best) * worth_while;
  const auto consider = [&](RegisterTile tile) {
    tile.phases = phases;
    const double needed = cost(tile);
    // Of equals, fewer registers; of the same, those of one row.
    const bool is_better =
        needed < least ||
        (needed == least && (sums_of(tile) < sums_of(best) ||
                             (sums_of(tile) == sums_of(best) && tile.vectors > best.vectors)));
    if (sums_of(tile) * bytes > machine.accumulator_bytes() || !is_better ||
        !shares_loads(tile, *operands))
      return;
    best = std::move(tile);
    least = needed;
  };
  for (int64_t n = 1; n <= std::min<int64_t>(vectors, most_values); n *= 2) {
    for (size_t i = 0; i < sides.size(); ++i) {
      for (const int64_t a : sizes_of_side(f, sides[i], sizes)) {
        consider({n, {{sides[i], a}}});
        for (size_t k = i + 1; k < sides.size(); ++k) {
          for (const int64_t b : sizes_of_side(f, sides[k], sizes))
            consider({n, {{sides[i], a}, {sides[k], b}}});
        }
      }
    }
  }
  return best.sides.empty() ? std::nullopt : std::optional(best);
}

int64_t RegisterTile::size_along(size_t dimension, int lanes) const {
  if (dimension == 0) return phases * vectors * lanes;
  for (const Side& side : sides) {
    if (side.dimension == dimension) return side.size;
  }
  return 1;
}

}  // namespace retrograde::autoschedule
