#include "autodiff/matrices/colouring.h"

#include <algorithm>

#include "ir/build.h"

namespace retrograde::autodiff {

namespace {

// The budget of the search in steps; beyond it the search fails.
constexpr int64_t many_steps = 20'000'000;

int64_t modulo(int64_t a, int64_t n) { return ((a % n) + n) % n; }

bool is_zero(const std::vector<int64_t>& v) {
  return std::ranges::all_of(v, [](int64_t c) { return c == 0; });
}

class Search {
 public:
  explicit Search(const std::vector<std::vector<int64_t>>& differences) {
    for (const auto& d : differences) {
      if (is_zero(d)) continue;
      // d and -d are equivalent.
      auto first = std::ranges::find_if(d, [](int64_t c) { return c != 0; });
      if (*first > 0) differences_.push_back(d);
    }
  }

  // Finds the first factors for n colours, in lexicographic order; false if there are none.
  bool find(int64_t n, Colouring& result) {
    result.count = n;
    std::ranges::fill(result.factors, 0);
    do {
      if (is_valid(result)) return true;
    } while (steps_ < many_steps && next(result));
    return false;
  }
  bool exhausted() const { return steps_ >= many_steps; }

 private:
  bool is_valid(const Colouring& c) {
    for (const auto& d : differences_) {
      ++steps_;
      if (c.of(d) == 0) return false;
    }
    return true;
  }
  // In one dimension no factor is better than 1.
  static bool next(Colouring& c) {
    int64_t end = c.factors.size() == 1 ? std::min<int64_t>(c.count, 2) : c.count;
    for (int64_t& k : c.factors) {
      if (++k < end) return true;
      k = 0;
    }
    return false;
  }
  std::vector<std::vector<int64_t>> differences_;
  int64_t steps_ = 0;
};

}  // namespace

Expr Colouring::of(const std::vector<Expr>& element) const {
  Expr n = make_const(Int(32), count), sum = make_zero(Int(32));
  for (size_t d = 0; d < factors.size(); ++d) {
    if (factors[d] == 0) continue;
    // Takes the remainder first: a product of two numbers below `count` does not overflow.
    Expr term = binary(Kind::Mod, element[d], n);
    sum = sum + (factors[d] == 1 ? term : term * make_const(Int(32), factors[d]));
  }
  return count == 1 ? make_zero(Int(32)) : binary(Kind::Mod, sum, n);
}

int64_t Colouring::of(const std::vector<int64_t>& element) const {
  int64_t sum = 0;
  for (size_t d = 0; d < factors.size(); ++d) sum += factors[d] * modulo(element[d], count);
  return modulo(sum, count);
}

std::optional<Colouring> smallest_colouring(const std::vector<std::vector<int64_t>>& differences,
                                            size_t dimensions, int64_t most) {
  Search search(differences);
  Colouring result{std::vector<int64_t>(dimensions, 0), 1};
  for (int64_t n = 1; n <= most && !search.exhausted(); ++n) {
    if (search.find(n, result)) return result;
  }
  return std::nullopt;
}

Colouring one_colour_each(const std::vector<int64_t>& extents) {
  Colouring result;
  for (int64_t extent : extents) {
    result.factors.push_back(result.count);
    result.count *= extent;
  }
  return result;
}

}  // namespace retrograde::autodiff
