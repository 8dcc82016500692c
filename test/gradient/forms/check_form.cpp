#include "gradient/forms/check_form.h"

#include <cmath>
#include <limits>
#include <random>
#include <sstream>

#include "autodiff/derivative.h"
#include "autodiff/rules/value_range.h"
#include "autodiff/sweeps/forward_sweep.h"
#include "autodiff/sweeps/local_derivative.h"
#include "autodiff/sweeps/reverse_sweep.h"
#include "diagnostics/error.h"
#include "frontend/language/func.h"
#include "gradient/forms/dual_oracle.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/scalar.h"
#include "ir/visit.h"
#include "support/evaluate.h"

namespace retrograde::gradient {

namespace {

constexpr int places = 6;
const char* const leaf_names[leaf_count] = {"x", "y", "z"};

// Random numbers of all magnitudes from 1e-3 to 4 and of either sign, rounded to the type.
Place place_of(std::mt19937_64& random, Type type) {
  Place at;
  std::uniform_real_distribution<double> exponent(-7, 1.4), sign(-1, 1);
  for (double& v : at) {
    v = std::copysign(std::min(4.0, std::exp(exponent(random))), sign(random));
    v = ir::round_to_type(type, std::fabs(v) < 0.05 && sign(random) > 0 ? v * 20 : v);
  }
  return at;
}

// The value of an expression, computed in its declared types.
double evaluate_at(const Expr& root, const Place& at) {
  std::map<std::string, ir::Scalar> leaves;
  for (size_t k = 0; k < leaf_count; ++k)
    leaves[leaf_names[k]] = ir::Scalar::of_float(root.type(), at[k]);
  return test::Evaluator(std::move(leaves))(root)[0].as_double();
}

using Gradient = std::array<Expr, leaf_count>;  // undefined: 0

Gradient by_reverse_sweep(const Expr& e) {
  Gradient result;
  const auto swept =
      autodiff::sweep_reverse({e}, {ir::make_one(e.type())}, [](const Expr&) { return true; }, {});
  for (const autodiff::LeafAdjoint& leaf : swept.leaves)
    result[static_cast<size_t>(leaf.leaf.as<ir::Variable>()->name[0] - 'x')] = leaf.adjoint;
  return result;
}

Gradient by_forward_sweep(const Expr& e) {
  Gradient result;
  for (size_t k = 0; k < leaf_count; ++k) {
    const auto seed = [&](const Expr& leaf) -> Expr {
      const auto* v = leaf.as<ir::Variable>();
      return v && v->name == leaf_names[k] ? ir::make_one(leaf.type()) : Expr();
    };
    result[k] = autodiff::sweep_forward({e}, seed, {}).tangents.front();
  }
  return result;
}

std::vector<std::array<double, leaf_count>> evaluate(const Gradient& gradient,
                                                     const std::vector<Place>& all) {
  std::vector<std::array<double, leaf_count>> result(all.size());
  for (size_t p = 0; p < all.size(); ++p) {
    for (size_t k = 0; k < leaf_count; ++k)
      result[p][k] = gradient[k].defined() ? evaluate_at(gradient[k], all[p]) : 0;
  }
  return result;
}

template <class T>
std::vector<std::array<double, leaf_count>> run_machine_code(const Expr& e,
                                                             const std::vector<Place>& all) {
  const int n = static_cast<int>(all.size());
  Var i("i");
  std::vector<Buffer<T>> images;
  ir::Substitution reads;
  for (size_t k = 0; k < leaf_count; ++k) {
    images.emplace_back(n);
    for (int p = 0; p < n; ++p) images[k](p) = static_cast<T>(all[static_cast<size_t>(p)][k]);
    reads[leaf_names[k]] = images[k](i);
  }
  Func f("form"), one("one");
  f(i) = ir::substitute(e, reads);
  one(i) = ir::make_one(e.type());
  const Derivative d = propagate_adjoints(f, one, {{0, n}});
  std::vector<std::array<double, leaf_count>> result(all.size());
  for (size_t k = 0; k < leaf_count; ++k) {
    Func gradient = d(images[k]);
    if (!gradient.defined()) continue;
    Buffer<T> found = gradient.realize({n});
    for (int p = 0; p < n; ++p) result[static_cast<size_t>(p)][k] = found(p);
  }
  return result;
}

class Comparison {
 public:
  Comparison(const Expr& e, const std::vector<Place>& all, uint64_t seed) : e_(e), all_(all) {
    for (const Place& at : all) expected_.push_back(true_gradient(e, at, seed));
  }

  void compare(const char* what, const std::vector<std::array<double, leaf_count>>& found) {
    for (size_t p = 0; p < all_.size(); ++p) {
      if (!expected_[p].is_usable) {
        ++result.outside;
        continue;
      }
      for (size_t k = 0; k < leaf_count; ++k) compare(what, p, k, found[p][k]);
    }
  }
  FormResult result;

 private:
  void compare(const char* what, size_t p, size_t k, double found) {
    const double slope = expected_[p].slope[k], reach = expected_[p].reach[k];
    const bool is_double = e_.type().bits() == 64;
    if (reach > (is_double ? 1e-4 : 1e-2) * std::fabs(slope) && reach > 0) {
      ++result.ill_conditioned;
      return;
    }
    ++result.checked;
    const double epsilon = is_double ? 0x1p-53 : 0x1p-24, least = is_double ? 1e-290 : 1e-30;
    const double allowed = 4 * reach + 64 * epsilon * std::fabs(slope) + least;
    if (std::fabs(found - slope) <= allowed || !result.finding.empty()) return;
    std::ostringstream text;
    text.precision(17);
    text << what << ": d/d" << leaf_names[k] << " is " << found << " instead of " << slope
         << " (+- " << allowed << ") at x = " << all_[p][0] << ", y = " << all_[p][1]
         << ", z = " << all_[p][2] << " of\n"
         << ir::print(e_);
    result.finding = text.str();
  }

  const Expr& e_;
  const std::vector<Place>& all_;
  std::vector<TrueGradient> expected_;
};

}  // namespace

FormResult& FormResult::operator+=(const FormResult& other) {
  checked += other.checked;
  ill_conditioned += other.ill_conditioned;
  outside += other.outside;
  if (finding.empty()) finding = other.finding;
  return *this;
}

FormResult check_form(const Expr& e, uint64_t seed, bool compile) {
  std::mt19937_64 random(seed);
  std::vector<Place> all;
  for (int p = 0; p < places; ++p) all.push_back(place_of(random, e.type()));
  Comparison comparison(e, all, seed);
  comparison.compare("reverse", evaluate(by_reverse_sweep(e), all));
  comparison.compare("forward", evaluate(by_forward_sweep(e), all));
  if (compile) {
    comparison.compare("machine code", e.type().bits() == 64 ? run_machine_code<double>(e, all)
                                                             : run_machine_code<float>(e, all));
  }
  return comparison.result;
}

}  // namespace retrograde::gradient
