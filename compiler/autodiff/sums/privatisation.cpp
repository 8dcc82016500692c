#include "autodiff/sums/privatisation.h"

#include <algorithm>

#include "autodiff/sums/blocked_sums.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/print.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// The number of parts of a privatised accumulation.
constexpr int part_count = planning::privatised_copies;
// Zeroing and summing parts may cost as much as this many elements an iteration. With fewer than least_parts, a scatter
// is not privatised.
constexpr double elements_an_iteration = 4;
constexpr int least_parts = 4;
// The number of elements of one part of a scatter, lanes included, that fit a near cache.
constexpr double near_elements = planning::second_cache_bytes / 64;
// The number of elements of a gather whose lanes are worth the way to a far cache.
constexpr double far_elements = planning::second_cache_bytes / 16;
// Memory budget in bytes for all parts of one adjoint. A larger target is accumulated in place, in parallel over its
// pure dimensions only.
constexpr double private_bytes = 4 * planning::third_cache_bytes;
// With at most few_elements elements, each of many_iterations iterations, the pure dimensions alone do not occupy a
// machine. Up to one_tile elements fit one register tile; up to few_elements fit a few tiles.
constexpr double one_tile = 64, few_elements = 1024, many_iterations = 4096;
// The least number of terms that a lane of a part adds if there are several tiles, so that zeroing and summing the
// parts cost little beside them.
constexpr double terms_a_lane = 8;
// Sums of at least this many iterations repay zeroing and summing the lanes.
constexpr double lanes_pay = 16 * lane_count;
// Planes of a sum that may be its parts: so many of each element, and of all elements together.
constexpr int64_t most_planes = 64;
constexpr double enough_planes = 64;

class PartSizes {
 public:
  PartSizes(const AdjointTarget& target, const std::vector<Type>& types)
      : target_(target), types_(types) {}

  bool sums_many_terms(const Gather& g) const {
    return g.rdom && (is_few_elements(g) || iterations_of(g, many_terms) >= many_terms);
  }
  // Whether the elements alone offer too little parallelism, and each sums over many iterations.
  bool is_worth_splitting(const Iterations& update) const {
    const Gather& g = update.over;
    return g.rdom && (leaves_lanes_idle(update) || is_few_elements(g));
  }
  bool is_few_elements(const Gather& g) const {
    if (elements_of(g) > few_elements) return false;
    if (parts_of(g) < least_parts) return false;
    const double iterations = iterations_of(g, many_iterations);
    const bool has_pure_dimension = std::ranges::find(g.pure, true) != g.pure.end();
    return iterations >= (has_pure_dimension ? many_iterations : part_count * lane_count);
  }
  // Whether vectors of elements are worse than vectors of terms, while each element sums over long rows. Rows of
  // elements may be shorter than a vector, as in a small kernel with many channels, or strided in what they read, as in
  // a layer that mixes channels.
  bool leaves_lanes_idle(const Iterations& update) const {
    const Gather& g = update.over;
    if (g.scatters || g.pure.empty() || target_.region.size() != g.pure.size()) return false;
    const auto row = as_const_int(g.rdom->vars[0].extent);
    const bool is_short = extent_of(target_.region[0]) * 2 <= lane_count;
    return g.pure[0] && (is_short || reads_across(update)) && (!row || *row >= lane_count) &&
           repays_lanes(g);
  }
  // Whether the lanes of all elements fit a near cache; those of more elements, as of a layer with many channels, pay if
  // each sums many terms.
  bool repays_lanes(const Gather& g) const {
    const double elements = elements_of(g), iterations = iterations_of(g, many_iterations);
    return elements <= near_elements ? iterations >= lanes_pay
                                     : elements <= far_elements && iterations >= many_iterations;
  }
  // Whether the reads are strided for neighbouring elements and contiguous for neighbouring terms.
  bool reads_across(const Iterations& update) const {
    const RowReads reads = row_reads(update);
    return reads.across && !reads.along;
  }
  // Whether vectors of elements are full, and contiguous in what they read.
  bool reads_along(const Iterations& update) const {
    const Gather& g = update.over;
    if (g.pure.empty() || !g.pure[0] || target_.region.size() != g.pure.size()) return false;
    const double extent = extent_of(target_.region[0]);
    const RowReads reads = row_reads(update);
    return extent >= lane_count && extent < unknown_elements && reads.along && !reads.across;
  }
  // The number of parts, a power of two; 1 means only lanes. Each part of a scatter holds every element that the
  // scatter may reach, so there are fewer parts if there are many elements for the iterations. If sizes are known at
  // run time only, this is the maximum.
  int parts_of(const Gather& g) const {
    if (!g.scatters && elements_of(g) > few_elements) return 1;
    if (!g.scatters && elements_of(g) > one_tile) return parts_of_a_tile(g);
    if (!g.scatters || target_.region.size() != g.pure.size()) return part_count;
    const double elements = elements_of_target();
    if (elements >= unknown_elements) return part_count;
    const double most = iterations_of(g, many_iterations) * elements_of(g) * elements_an_iteration /
                        std::max(elements, 1.0);
    int parts = part_count;
    while ((parts > most || parts * elements * bytes_an_element() > private_bytes) && parts > 1)
      parts /= 2;
    return parts;
  }
  // The number of parts for elements that fill a few register tiles. Each part has lanes for every element, which must
  // be zeroed and summed.
  int parts_of_a_tile(const Gather& g) const {
    int parts = part_count;
    while (parts > 1 && iterations_of(g, many_iterations) < parts * lane_count * terms_a_lane)
      parts /= 2;
    return parts;
  }
  double bytes_an_element() const { return total_bytes(types_); }
  // Whether the outermost loop goes from plane to plane of what is read, each of which belongs to one element, and each
  // element sums all of its planes: as the sum over pixels and images of a batch, for each channel. Then each plane is a
  // part, so that what reads the same planes may run in the same loops.
  bool are_parts_planes(const Iterations& update) const {
    const Gather& g = update.over;
    const size_t count = update.rvars.size();
    if (g.scatters || update.has_taps || count < 2) return false;
    const auto planes = as_const_int(update.rvars[count - 1].extent);
    return planes && *planes > 1 && *planes <= most_planes &&
           elements_of(g) * static_cast<double>(*planes) >= enough_planes &&
           reads_each_once(update);
  }
  // `parts_of`, or at run time the number of parts that fit if that is smaller.
  Expr part_count_of(const Gather& g) const {
    const Expr most = make_const(Int(32), parts_of(g));
    if (!g.scatters || target_.region.size() != g.pure.size() ||
        elements_of_target() < unknown_elements)
      return most;
    Expr fit = make_const(Int(64), static_cast<int64_t>(private_bytes / bytes_an_element()));
    for (const LoopVariable& v : target_.region) {
      if (!v.range().is_bounded()) return most;
      fit = fit / max(cast_to(Int(64), v.max - v.min + 1), make_one(Int(64)));
    }
    return simplify(cast_to(Int(32), min(max(fit, make_one(Int(64))), cast_to(Int(64), most))));
  }
  // Lanes let a gather add in vectors if its elements do not fill them, as the column sums of a matrix do. In a scatter,
  // neighbouring iterations often meet in one element and would wait for each other, so lanes get elements of their own
  // if there are few.
  bool has_lanes(const Iterations& update) const {
    const Gather& g = update.over;
    if (!g.scatters) return !reads_along(update);
    if (target_.region.size() != g.pure.size()) return false;
    const double elements = elements_of_target() * lane_count;
    const double iterations = iterations_of(g, many_iterations) * elements_of(g);
    return elements * static_cast<double>(types_.size()) <= near_elements &&
           elements * parts_of(g) <= iterations;
  }
  std::string note(const Gather& g, const Expr& count) const {
    const double bytes = elements_of_target() * bytes_an_element();
    if (!g.scatters || as_const_int(count) == 1) return "";
    const std::string number = is_const(count) ? ir::print(count) : text("at most ", parts_of(g));
    const std::string each =
        bytes >= unknown_elements ? "" : text(" of ", static_cast<int64_t>(bytes), " bytes each");
    return text("accumulated in ", number, " privatised copies", each, ", as many as fit ",
                static_cast<int64_t>(private_bytes), " bytes");
  }

 private:
  // Whether all that the innermost loop moves is read by one element only, in an order in which the outermost loop comes
  // after the elements.
  bool reads_each_once(const Iterations& update) const {
    const std::string &inner = update.rvars[0].var, &outer = update.rvars.back().var;
    bool result = true, has_planes = false;
    const auto note = [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (!call || call->call_type == CallType::Operator) return true;
      const auto place_of = [&](const std::string& name) {
        return std::ranges::find_if(call->args,
                                    [&](const Expr& arg) { return uses_variable(arg, name); }) -
               call->args.begin();
      };
      const auto none = static_cast<std::ptrdiff_t>(call->args.size());
      if (place_of(inner) == none) return true;
      for (size_t d = 0; d < update.over.pure.size(); ++d) {
        const auto place = update.over.pure[d] ? place_of(target_.args[d]) : 0;
        result &= place < none && place < place_of(outer);
      }
      has_planes |= place_of(inner) < place_of(outer);
      return true;
    };
    for (const Expr& sum : update.all.sums) {
      if (sum.defined()) walk(sum, note);
    }
    return result && has_planes;
  }
  // Whether neighbouring elements are neighbours in some reads, and whether neighbouring terms are in reads in which
  // elements lie in other rows.
  struct RowReads {
    bool along = false, across = false;
  };
  RowReads row_reads(const Iterations& update) const {
    const std::string &row = target_.args[0], &term = update.rvars[0].var;
    RowReads result;
    const auto note = [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (!call || call->call_type == CallType::Operator || call->args.empty()) return true;
      result.along |= uses_variable(call->args[0], row);
      result.across |= uses_variable(call->args[0], term) &&
                       std::any_of(call->args.begin() + 1, call->args.end(),
                                   [&](const Expr& arg) { return uses_variable(arg, row); });
      return true;
    };
    for (const Expr& sum : update.all.sums) {
      if (sum.defined()) walk(sum, note);
    }
    return result;
  }
  double elements_of_target() const {
    double elements = 1;
    for (const LoopVariable& v : target_.region) elements *= extent_of(v);
    return elements;
  }
  // The number of iterations; a loop of unknown extent counts as `unknown`.
  static double iterations_of(const Gather& g, double unknown) {
    double iterations = 1;
    for (const ReductionVariable& r : g.rdom->vars) {
      auto extent = as_const_int(r.extent);
      iterations *= extent ? static_cast<double>(*extent) : unknown;
    }
    return iterations;
  }
  // The number of elements that the pure dimensions of the update run over; very large if unknown.
  double elements_of(const Gather& g) const {
    double elements = 1;
    for (size_t d = 0; d < g.pure.size(); ++d) {
      if (!g.pure[d]) continue;
      if (target_.region.size() != g.pure.size()) return unknown_elements;
      elements *= extent_of(target_.region[d]);
    }
    return elements;
  }
  static double extent_of(const LoopVariable& v) {
    auto extent = constant_extent(v.range());
    return extent ? static_cast<double>(*extent) : unknown_elements;
  }

  const AdjointTarget& target_;
  const std::vector<Type>& types_;
};

}  // namespace

bool sums_many_terms(const Gather& g, const AdjointTarget& target, const std::vector<Type>& types) {
  return PartSizes(target, types).sums_many_terms(g);
}

// Whether the terms read Funcs or images along their rows when the variable steps.
static bool moves_along_rows(const Iterations& update, const std::string& variable) {
  const auto reads_along = [&](const Expr& e) {
    const auto* call = e.as<Call>();
    return call && call->call_type != CallType::Operator && !call->args.empty() &&
           uses_variable(call->args[0], variable);
  };
  return std::ranges::any_of(update.all.sums, [&](const Expr& sum) {
    return sum.defined() && any_node(sum, reads_along);
  });
}

Iterations with_rows_innermost(Iterations update, PartPlan& plan) {
  const size_t count = update.rvars.size() - (update.has_taps ? 1 : 0);
  if (update.over.scatters || count < 2 || moves_along_rows(update, update.rvars[0].var))
    return update;
  const auto end = update.rvars.begin() + static_cast<long>(count);
  const auto row = std::find_if(update.rvars.begin() + 1, end, [&](const ReductionVariable& r) {
    return as_const_int(r.extent).value_or(lane_count) >= lane_count &&
           moves_along_rows(update, r.var);
  });
  if (row == end) return update;
  const std::string in_parts = update.rvars[plan.loop].var;
  std::rotate(update.rvars.begin(), row, row + 1);
  const auto loop = std::ranges::find(update.rvars, in_parts, &ReductionVariable::var);
  plan.loop = static_cast<size_t>(loop - update.rvars.begin());
  return update;
}

// The loop that is split into parts if these are no planes: the outermost with enough iterations to run in parallel, so
// that a part reads contiguous memory; else the longest loop.
static size_t loop_in_parts(const Iterations& update) {
  const size_t count = update.rvars.size() - (update.has_taps ? 1 : 0);
  const auto extent = [&](size_t i) {
    return as_const_int(update.rvars[i].extent).value_or(INT64_MAX);
  };
  size_t longest = count - 1;
  for (size_t i = count; i-- > 0;) {
    if (extent(i) >= planning::reference_tasks) return i;
    if (extent(i) > extent(longest)) longest = i;
  }
  return longest;
}

std::optional<PartPlan> plan_parts(const Iterations& update, const AdjointTarget& target,
                                   const std::vector<Type>& types) {
  const PartSizes sizes(target, types);
  if (!sizes.is_worth_splitting(update)) return std::nullopt;
  const Gather& g = update.over;
  const bool has_parts = sizes.parts_of(g) > 1, has_lanes = sizes.has_lanes(update);
  if (!has_parts && !has_lanes) return std::nullopt;
  if (has_parts && sizes.are_parts_planes(update)) {
    const size_t loop = update.rvars.size() - 1;
    return PartPlan{true, loop, update.rvars[loop].extent, has_lanes, ""};
  }
  const size_t loop = loop_in_parts(update);
  const Expr count = sizes.part_count_of(g), all = update.rvars[loop].extent;
  const bool has_empty_parts =
      !g.scatters && as_const_int(all).value_or(INT64_MAX) < as_const_int(count).value_or(0);
  return PartPlan{has_parts, loop, has_empty_parts ? all : count, has_lanes, sizes.note(g, count)};
}

// If the variable in parts is also the innermost, x = (part * chunk + rho) * lanes + lane; else lanes split the
// innermost variable. Indices beyond the end are clamped, because the elements that are read must exist even where the
// condition is false. Loop partitioning removes clamp and condition from the steady state, whose accumulators stay in
// registers. Each plane of a sum is a part as it is.
Slice slice_of(const Iterations& update, const Expr& lane, const Expr& part, const PartPlan& plan,
               bool in_blocks) {
  Slice slice;
  const DomainPtr rdom = make_domain();
  const Expr& parts = plan.count;
  for (size_t i = 0; i < update.rvars.size(); ++i) {
    const auto& [old, min, all, _] = update.rvars[i];
    ReductionVariable r{unique_name(old), make_zero(Int(32)), all};
    const bool in_parts = i == plan.loop && part.defined(), in_lanes = i == 0 && lane.defined();
    if (in_parts && !in_lanes && equal(parts, all)) {
      slice.place[old] = min + part;
      continue;
    }
    if (in_lanes) r.extent = simplify((r.extent + (lane_count - 1)) / lane_count);
    if (in_parts) r.extent = simplify((r.extent + (parts - 1)) / parts);
    if ((in_parts || in_lanes) && in_blocks) r.extent = in_whole_blocks(r.extent);
    Expr at = loop_variable(rdom, r.var);
    if (in_parts) at = part * r.extent + at;
    if (in_lanes) at = at * lane_count + lane;
    if (in_parts || in_lanes) {
      slice.conditions.push_back(likely(at < all));
      at = binary(Kind::Min, likely(at), all - 1);
      if (!as_const_int(all)) at = max(at, make_zero(Int(32)));  // the extent may be 0
    }
    slice.place[old] = min + at;
    slice.rvars.push_back(r);
  }
  rdom->vars = slice.rvars;
  return slice;
}

std::vector<Expr> parts_point(const Gather& g, const std::vector<Expr>& element, const Expr& lane,
                              const Expr& part) {
  std::vector<Expr> point;
  if (lane.defined()) point.push_back(lane);
  for (size_t d = 0; d < element.size(); ++d) {
    if (g.scatters || g.pure[d]) point.push_back(element[d]);
  }
  if (part.defined()) point.push_back(part);
  return point;
}

}  // namespace retrograde::autodiff
