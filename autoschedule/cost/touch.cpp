#include "autoschedule/cost/touch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/machine/reference.h"

namespace retrograde::planning {

double iterations_of(IteratorSet iterators, const Cover& cover) {
  double result = 1;
  for (size_t i = 0; i < cover.size(); ++i)
    if (iterators & set_of(static_cast<int>(i))) result *= static_cast<double>(cover[i]);
  return result;
}

namespace {

double points_in(const Cover& cover, int iterator) {
  return static_cast<double>(cover[static_cast<size_t>(iterator)]);
}

// Elements along a dimension: how many, and from the first to the last one.
struct Span {
  double points, reach;
  bool is_dense() const { return points >= reach; }
};

Span span_of(const TouchedSide& side, const Cover& cover) {
  Span span{side.taps, side.reach};
  for (const TouchedSide::Move& move : side.moves) {
    const double points = points_in(cover, move.iterator), step = std::abs(move.slope);
    const double count = move.period > 0 ? std::min(points, move.period) : points;
    if (count <= 1) continue;
    const bool joins = span.is_dense() && step <= span.reach;
    span.reach += step * (count - 1);
    span.points = joins ? span.reach : std::min(span.points * count, span.reach);
  }
  if (iterations_of(side.data, cover) > 1) {
    span.reach = side.is_displaced ? span.reach + displacement * side.divisor
                                   : std::numeric_limits<double>::infinity();
    span.points = span.reach;
  }
  span.reach = std::min(std::floor((span.reach - 1) / side.divisor) + 1, side.most);
  span.points = std::min(span.points, span.reach);
  return span;
}

double data_slope(const TouchedSide& side) {
  double slope = 0;
  for (const TouchedSide::Move& move : side.moves) slope += std::abs(move.slope);
  return slope / side.divisor;
}

}  // namespace

double Layout::elements() const {
  double result = 1;
  for (const double extent : extents) result *= extent;
  return result;
}

// Regular dimensions multiply. A data-dependent dimension is touched anywhere between its ends, but by no more lines
// than there are iterations. Neither are all of them together: table(index(y), y) is a line for each y.
double touched_lines(const Touch& touch, const Layout& layout, const Cover& cover) {
  const double in_line = static_cast<double>(line_bytes) / touch.element_bytes;
  double lines = 1, by_data = 1, data_taps = 1, lines_a_point = 1;
  double points = iterations_of(touch.moved, cover);
  double run = 1;        // elements that lie together
  bool is_whole = true;  // all dimensions so far are touched from end to end
  for (size_t place = 0; place < layout.order.size(); ++place) {
    const auto d = static_cast<size_t>(layout.order[place]);
    const TouchedSide& side = touch.sides[d];
    const Span span = span_of(side, cover);
    const bool has_data = side.data != 0;
    points *= side.taps;
    const double count =
        place > 0 ? span.points : std::min(span.points, std::ceil(span.reach / in_line));
    (has_data ? by_data : lines) *= count;
    if (has_data && place > 0) {
      data_taps *= side.taps;
      lines_a_point *=
          side.is_displaced ? std::min(side.taps, std::max(1.0, data_slope(side))) : side.taps;
    }
    is_whole = is_whole && !has_data;
    if (is_whole && span.is_dense()) {
      run *= span.points;
      lines = std::min(lines, std::ceil(run / in_line));
    }
    is_whole = is_whole && span.points >= layout.extents[d];
  }
  if (touch.data != 0)
    by_data = std::min(by_data, (iterations_of(touch.data, cover) - 1) * lines_a_point + data_taps);
  return std::min(lines * by_data, points) * touch.components;
}

double bytes_by_sets(const Touch& touch, const Layout& layout, const Cover& cover,
                     int64_t set_stride) {
  const auto all = static_cast<double>(set_stride), line = static_cast<double>(line_bytes);
  double touched = line, sets = line;  // bytes; of these, in different sets
  double stride = touch.element_bytes;
  for (const int16_t dimension : layout.order) {
    const TouchedSide& side = touch.sides[static_cast<size_t>(dimension)];
    const Span span = span_of(side, cover);
    if (side.data != 0 && !side.is_displaced) return 0;
    if (stride * span.reach <= touched) {
      // Inside of the line, or of the rows so far.
    } else if (stride < touched) {
      touched = sets = stride * span.reach;
    } else {
      // Rows of nearly the same sets are a little apart there. Others spread evenly over all sets that they ever reach.
      const int64_t step = static_cast<int64_t>(stride) % set_stride;
      const double apart = double(std::min(step, set_stride - step));
      const double places = all / double(std::max(std::gcd(step, set_stride), line_bytes));
      const double reach = apart * (span.points - 1);
      touched *= span.points;
      sets = reach < all && apart < sets ? sets + reach : sets * std::min(span.points, places);
    }
    sets = std::min(sets, all);
    stride *= layout.extents[static_cast<size_t>(dimension)];
  }
  if (touch.data != 0) touched = std::min(touched, touched_lines(touch, layout, cover) * line);
  return touched / sets * all;
}

namespace {

// Where the lanes of a divided or wrapped index lie. Vectors have a form if a period of the index ends with each of them,
// or holds all of it: x / 2, x / 16 and x % 32 do with 16 lanes, but x / 3 and x % 20 do not.
enum class Bend { None, EachVector, Anywhere };
bool divides(double a, double b) { return std::fmod(b, a) == 0; }
// Whether an index that wraps is back where it was from each lane to the next.
bool wraps_to_itself(const TouchedSide& side, const TouchedSide::Move& move,
                     const LaneLoop& lanes) {
  if (move.period > 0) return divides(move.period, lanes.step);
  return side.modulus > 0 && divides(side.modulus * side.divisor, move.slope * lanes.step);
}
Bend bend_of(const TouchedSide& side, const TouchedSide::Move& move, const LaneLoop& lanes) {
  const double step = std::abs(move.slope * lanes.step), all = step * lanes.inner;
  const double quotient = all / side.divisor, points = lanes.step * lanes.inner;
  if (move.period > 0 && !divides(points, move.period))
    return divides(move.period, points) ? Bend::EachVector : Bend::Anywhere;
  if (side.modulus != 0 && !divides(side.modulus, quotient) && !divides(quotient, side.modulus))
    return Bend::Anywhere;
  if (divides(side.divisor, step)) return Bend::None;
  return divides(side.divisor, all) || divides(all, side.divisor) ? Bend::EachVector
                                                                  : Bend::Anywhere;
}

// Whether vectors of this size cross no line if the first one does not, as far as this dimension is concerned.
bool keeps_alignment(const TouchedSide& side, double row_bytes, const LaneLoop& lanes,
                     double vector_bytes) {
  const bool has_others = side.taps > 1 || side.data != 0;
  return (!has_others || divides(vector_bytes, row_bytes)) &&
         std::ranges::all_of(side.moves, [&](const TouchedSide::Move& move) {
           return move.iterator == lanes.iterator || move.iterator == lanes.outer ||
                  divides(vector_bytes, move.slope / side.divisor * row_bytes);
         });
}

}  // namespace

LaneMoves lane_moves(const Touch& touch, const Layout& layout, const LaneLoop& lanes,
                     double vectors) {
  LaneMoves result;
  if ((touch.moved & lanes.moves) == 0) return result;
  result.is_by_lane = (touch.data & lanes.moves) != 0;
  double row = 1, stride = 0, outer_stride = 0;
  for (const int16_t dimension : layout.order) {
    const TouchedSide& side = touch.sides[static_cast<size_t>(dimension)];
    for (const TouchedSide::Move& move : side.moves) {
      const double slope = move.slope / side.divisor * row;
      if (move.iterator == lanes.outer) outer_stride += slope;
      if (move.iterator != lanes.iterator || wraps_to_itself(side, move, lanes)) continue;
      if (side.is_clamped) {  // the first and the last block of a row
        const double points = std::max(lanes.block, lanes.inner * lanes.step);
        const double reach = points * std::abs(move.slope) / side.divisor;
        result.border_share = std::max(result.border_share, std::min(1.0, 2 * reach / side.most));
      }
      const Bend bend = bend_of(side, move, lanes);
      result.is_bent = result.is_bent || bend != Bend::None;
      result.is_by_lane = result.is_by_lane || bend == Bend::Anywhere;
      stride += slope * lanes.step;
    }
    row *= layout.extents[static_cast<size_t>(dimension)];
  }
  if (result.is_bent) {  // neighbours share elements
    result.vectors = 2 * vectors;
  } else if (std::abs(stride) == 1) {  // runs that lie apart are put together
    const bool is_joined = lanes.outer < 0 || outer_stride == stride * lanes.inner;
    result.vectors = is_joined ? vectors : std::max(vectors, std::ceil(lanes.count / lanes.inner));
    const double bytes = std::min(double(line_bytes), lanes.count * touch.element_bytes);
    double row_bytes = touch.element_bytes;
    for (const int16_t dimension : layout.order) {
      const auto d = static_cast<size_t>(dimension);
      const bool is_kept = keeps_alignment(touch.sides[d], row_bytes, lanes, bytes);
      result.is_shifted = result.is_shifted || (!is_kept && dimension == layout.order[0]);
      result.is_unaligned = result.is_unaligned || !is_kept;
      row_bytes *= layout.extents[d];
    }
    if (stride < 0 || result.vectors > vectors) result.shuffles = result.vectors;
  } else if (stride != 0) {
    result.is_by_lane = result.is_by_lane || std::abs(stride) > longest_vector_stride;
    result.vectors = std::max(1.0, std::abs(stride)) * vectors;
    result.shuffles = (touch.writes ? 2 : 1) * result.vectors;
  }
  return result;
}

// ---- from accesses ----

namespace {

class TouchReader {
 public:
  TouchReader(const SizeModel& sizes, const Motions& motions) : sizes_(sizes), motions_(motions) {}

  // `accesses` differ in constants alone.
  Touch read(const std::vector<const Access*>& accesses) const {
    const Access& first = *accesses[0];
    Touch touch;
    const auto func_count = static_cast<int>(sizes_.graph().funcs().size());
    touch.buffer = first.of >= 0 ? first.of : func_count + first.image;
    touch.writes = first.writes;
    touch.element_bytes = bytes_of(first);
    uint32_t components = 0;
    touch.count = 0;
    for (const Access* access : accesses) {
      components |= access->components;
      touch.count += __builtin_popcount(access->components);
    }
    touch.components = __builtin_popcount(components);
    for (size_t d = 0; d < first.index.size(); ++d) {
      touch.sides.push_back(side_of(accesses, d));
      touch.moved |= first.index[d].moved_by();
      touch.data |= touch.sides.back().data;
    }
    return touch;
  }

 private:
  const SizeModel& sizes_;
  const Motions& motions_;

  // A component's.
  double bytes_of(const Access& access) const {
    const AccessGraph& graph = sizes_.graph();
    if (access.of < 0) return graph.images()[static_cast<size_t>(access.image)]->type.bytes();
    double bytes = 0;
    const std::vector<Type>& types = graph.func(access.of).func->types;
    for (const Type& type : types) bytes += type.bytes();
    return std::max(1.0, bytes / static_cast<double>(std::max<size_t>(types.size(), 1)));
  }

  // Whether the loops go beyond the ends of a clamp.
  bool crosses_border(const Access& access, size_t d) const {
    IndexForm free = access.index[d];
    if (!free.clamped) return false;
    const ir::ConstantRange within = sizes_.range(free.within);
    // It may be clamped at one end alone.
    const bool is_known = within.has_lower_bound() == free.within.has_lower_bound() &&
                          within.has_upper_bound() == free.within.has_upper_bound();
    free.within = {};
    free.expr = {};
    return !is_known || !sizes_.range(free, access.by).is_within(within);
  }

  TouchedSide side_of(const std::vector<const Access*>& accesses, size_t d) const {
    const IndexForm& form = accesses[0]->index[d];
    TouchedSide side;
    std::set<std::pair<int64_t, int64_t>> taps;
    int64_t low = form.low, high = form.high;
    for (const Access* access : accesses) {
      taps.emplace(access->index[d].low, access->index[d].high);
      side.is_clamped = side.is_clamped || crosses_border(*access, d);
      low = std::min(low, access->index[d].low);
      high = std::max(high, access->index[d].high);
    }
    side.taps = 0;
    for (const auto& [first, last] : taps) side.taps += static_cast<double>(last - first + 1);
    side.reach = static_cast<double>(high - low + 1);
    side.taps = std::min(side.taps, side.reach);
    side.divisor = static_cast<double>(form.divisor);
    side.modulus = static_cast<double>(form.modulus);
    side.most = static_cast<double>(std::max<int64_t>(sizes_.of(*accesses[0], d).estimate, 1));
    const ir::ConstantRange within = sizes_.range(form.within);
    if (within.is_bounded())
      side.most = std::min(side.most, std::max(1.0, static_cast<double>(within.extent())));
    if (form.modulus != 0) side.most = std::min(side.most, static_cast<double>(form.modulus));
    for (const Term& term : form.terms)
      side.moves.push_back({term.iterator, static_cast<double>(term.coefficient)});
    for (const OpaqueTerm& term : form.opaque) add_opaque(side, term);
    std::ranges::sort(side.moves, {}, [](const auto& move) { return std::abs(move.slope); });
    return side;
  }

  // Points after which a remainder begins again.
  static double period_of(const Motion& motion, double slope) {
    return motion.period / double(std::gcd(int64_t(motion.period), int64_t(slope)));
  }
  static bool is_remainder(const OpaqueTerm& term, const Motion* motion) {
    return !term.value.from_data && motion && motion->period > 0 &&
           std::ranges::all_of(motion->slopes, [](double s) { return s == std::floor(s); });
  }

  void add_opaque(TouchedSide& side, const OpaqueTerm& term) const {
    if (term.value.iterators.empty()) return;
    const Motion* motion = motions_.of(term.value);
    if (is_remainder(term, motion)) {
      for (size_t i = 0; i < term.value.iterators.size(); ++i) {
        const double slope = motion->slopes[i];
        if (slope != 0)
          side.moves.push_back({term.value.iterators[i], slope * double(term.coefficient),
                                period_of(*motion, slope)});
      }
      return;
    }
    side.data |= term.value.depends();
    side.is_displaced = !motion || !motion->is_table;
    if (!side.is_displaced) return;
    for (size_t i = 0; i < term.value.iterators.size(); ++i) {
      const double known = motion ? motion->slopes[i] : NAN;
      const double slope = std::isnan(known) ? unknown_slope : known;
      if (slope != 0)
        side.moves.push_back({term.value.iterators[i], slope * double(term.coefficient)});
    }
    // Values that nothing but data move go anywhere between their ends.
    side.is_displaced = !side.moves.empty();
    const ir::ConstantRange range = sizes_.range(term.range);
    if (side.moves.empty() && range.is_bounded())
      side.most = std::min(side.most, std::max(1.0, side.reach - 1 + double(range.extent())));
  }
};

bool differ_in_constants(const Access& a, const Access& b) {
  return a.of == b.of && a.image == b.image && a.writes == b.writes &&
         std::ranges::equal(a.index, b.index,
                            [](const IndexForm& f, const IndexForm& g) { return f.same_parts(g); });
}

}  // namespace

std::vector<Touch> touches_of(const std::vector<const Access*>& accesses, const SizeModel& sizes,
                              const Motions& motions) {
  std::vector<std::vector<const Access*>> alike;
  for (const Access* access : accesses) {
    const auto found = std::ranges::find_if(
        alike, [&](const auto& list) { return differ_in_constants(*list[0], *access); });
    found == alike.end() ? alike.push_back({access}) : found->push_back(access);
  }
  const TouchReader reader(sizes, motions);
  return ir::mapped(alike, [&](const auto& list) { return reader.read(list); });
}

}  // namespace retrograde::planning
