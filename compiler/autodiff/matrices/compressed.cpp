#include "autodiff/matrices/compressed.h"

#include <algorithm>

#include "autodiff/matrices/colour_dimension.h"
#include "autodiff/sums/generated_definitions.h"
#include "diagnostics/error.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// Up to this many colours the matrix counts as small and dense.
constexpr int64_t many_colours = 4096;
// With so few colours a better colouring gains little.
constexpr int64_t few_colours = 3;
// The most differences that are examined one by one.
constexpr int64_t many_differences = 100'000;
// The isl budget of a simplification that saves little: dropping a condition.
constexpr unsigned long covering_operations = 200'000;

int64_t product(const std::vector<int64_t>& factors) {
  int64_t result = 1;
  for (int64_t f : factors) {
    if (f > many_colours * many_colours || result > many_colours * many_colours) return INT64_MAX;
    result *= f;
  }
  return result;
}

// Throws Unsupported if isl exceeds its budget.
template <class Search>
auto found_or_refused(const CompressionQuery& query, const Search& search) {
  try {
    return search();
  } catch (const isl::exception&) {
    unsupported(text("compress the derivative in ", quoted(query.output->name)),
                "which elements depend on which is found by a bounded search over index sets",
                text("a part of it takes more than ", query.operations, " operations of isl"),
                "Use products with single directions, or differentiate parts of it");
  }
}

}  // namespace

Compressed::Compressed(const CompressionQuery& query)
    : query_(query),
      dependence_(std::make_unique<Dependence>(query.output, query.seed, query.operations)),
      pattern_(dependence_->inside(query.rows, query.columns)) {}

std::unique_ptr<Compressed> Compressed::make(const CompressionQuery& query) {
  return found_or_refused(query, [&]() -> std::unique_ptr<Compressed> {
    std::unique_ptr<Compressed> result(new Compressed(query));
    std::optional<Colours> colours = result->colour();
    if (!colours) return nullptr;
    result->colours_ = *colours;
    return result;
  });
}

// Each later query of the pattern has the whole budget.
template <class Search>
auto Compressed::searched(const Search& search) const {
  isl_ctx_reset_operations(dependence_->context().ctx);
  return found_or_refused(query_, search);
}

std::optional<Colours> Compressed::colour() const {
  size_t dims = query_.seed->args.size();
  if (dims == 0 || pattern_.is_empty()) return Colours{{std::vector<int64_t>(dims, 0), 1}, {}};
  isl::set differences =
      (query_.diagonal_only ? pattern_ : pattern_.reverse().apply_range(pattern_)).deltas();
  int64_t most = query_.most_colours > 0 ? query_.most_colours : many_colours;
  std::optional<Colouring> linear = linear_colours(coalesced(differences), most);
  // Tables are for irregular patterns of few elements; for others they cost more than they save. For the diagonal it
  // suffices that neighbours differ, whether or not M is symmetric.
  if (!linear || linear->count > few_colours) {
    if (auto table = colour_table(pattern_, query_.symmetric || query_.diagonal_only,
                                  linear ? linear->count : most + 1))
      return Colours{{}, table};
  }
  if (!linear && query_.most_colours == 0) {
    unsupported(text("compress the derivative in ", quoted(query_.output->name)),
                text("at most ", many_colours, " seeds are evaluated together"),
                text("the pattern needs more"),
                "Use products with single directions, or differentiate parts of it");
  }
  if (!linear) return std::nullopt;
  return Colours{*linear, {}};
}

std::optional<Colouring> Compressed::linear_colours(const isl::set& differences,
                                                    int64_t most) const {
  auto ranges = ranges_of(differences);
  if (!ranges) {
    unsupported(text("compress the derivative in ", quoted(query_.output->name)),
                "elements that one element may depend on must lie within constant bounds",
                "the pattern has entries without bounds: an index depends on data, or a reduction "
                "runs over a range that is not constant",
                "Give constant bounds, of the output and of Buffers, or use products with "
                "single directions");
  }
  std::vector<int64_t> extents;
  int64_t all_differences = 1;
  for (const ConstantRange& r : *ranges) {
    extents.push_back(std::max(std::abs(r.min), std::abs(r.max)) + 1);
    all_differences = std::min(all_differences * (2 * extents.back() - 1), many_differences + 1);
  }
  int64_t enough = product(extents);
  std::optional<Colouring> found;
  if (auto points =
          points_of(differences, all_differences > many_differences ? 0 : many_differences)) {
    // If all differences of a box occur, all pairs of elements conflict.
    bool is_box = static_cast<int64_t>(points->size()) == all_differences;
    if (!is_box) found = smallest_colouring(*points, extents.size(), std::min(most, enough));
  }
  if (!found && enough <= most) found = one_colour_each(extents);
  return found;
}

// 1 for elements of the colour. Elements outside of the columns are not part of the pattern.
Expr Compressed::seed_value(const std::vector<Expr>& column, const Expr& colour) const {
  Type type = query_.seed->types[0];
  Expr condition = colours_.of(column) == colour;
  const auto covers = found_within(dependence_->context().ctx, covering_operations, [&] {
    return dependence_->inside(query_.rows, {}).is_subset(pattern_);
  });
  if (!covers.value_or(false)) {
    for (size_t d = 0; d < column.size(); ++d) {
      const Interval& range = query_.columns[d];
      if (range.min.defined()) condition = condition && column[d] >= range.min;
      if (range.max.defined()) condition = condition && column[d] <= range.max;
    }
  }
  return make_select(condition, make_one(type), make_zero(type));
}

FuncPtr Compressed::evaluate() const {
  if (searched([&] { return pattern_.is_empty(); })) return nullptr;
  const FuncPtr seeds =
      make_func(Role::Coloured, query_.seed->name + "_by_colour", query_.seed->name);
  seeds->made->traits.masked = true;
  const std::vector<Expr> column = variables_of(query_.seed->args);
  std::vector<Expr> args = column;
  args.push_back(variable(unique_name("colour")));
  define_pure(seeds, args, {seed_value(column, args.back())});
  return with_seeds(query_.output, query_.seed, seeds);
}

Expr Compressed::may_be_nonzero(const std::vector<Expr>& row,
                                const std::vector<Expr>& column) const {
  std::vector<Expr> names = row;
  append(names, column);
  const auto dims = numbered(names.size(), [](size_t d) { return "e" + std::to_string(d); });
  return searched([&] {
    return simplify(
        IslBridge(dependence_->context(), dims).to_expr(pattern_.wrap().flatten(), names));
  });
}

// A star colouring determines an entry from its own row, or from its transpose in the other row.
Expr Compressed::entry(const FuncPtr& all, const std::vector<Expr>& row,
                       const std::vector<Expr>& column, int k) const {
  auto at = [&](std::vector<Expr> place, const std::vector<Expr>& other) {
    place.push_back(colours_.of(other));
    return call_value(all, place, k);
  };
  Expr direct = at(row, column);
  if (!colours_.table || !colours_.table->alone.defined()) return direct;
  return make_select(colours_.table->is_alone(row, colours_.of(column)), direct, at(column, row));
}

std::optional<std::vector<ConstantRange>> Compressed::offsets() const {
  if (query_.seed->args.size() != query_.output->args.size()) return std::nullopt;
  return searched([&]() -> std::optional<std::vector<ConstantRange>> {
    isl::set deltas = pattern_.deltas();
    if (deltas.is_empty())
      return std::vector<ConstantRange>(query_.seed->args.size(), ConstantRange::point(0));
    return ranges_of(deltas);
  });
}

}  // namespace retrograde::autodiff
