// In-place updates.
//
// An update may overwrite a value that its own derivative needs. Reverse mode then stores versions of the
// value, within a budget that you can set, and reports this. You can also forbid it; the error message then
// says how to rewrite the program.
#include <retrograde/retrograde.h>

#include <cmath>

#include "tutorial.h"

using namespace retrograde;

int main(int argc, char** argv) {
  const int n = 8;
  Buffer<float> a(n);
  for (int i = 0; i < n; ++i) a(i) = i == 3 ? 0.0f : 0.75f + 0.125f * static_cast<float>(i);
  RDom r(0, n);

  // ---- A sum needs none of its overwritten values: the derivative of f + a by a is 1 for every f. ----
  Func total("total");
  total() = 0.0f;
  total() += a(r);
  Derivative of_sum = propagate_adjoints(total, {.overwritten = Overwritten::Refuse});
  Buffer<float> ones = of_sum(a).realize({n});
  bool right = true;
  for (int i = 0; i < n; ++i) right = right && ones(i) == 1.0f;
  claim(right, "a sum needs no versions, so Overwritten::Refuse accepts it");

  // ---- A product does: the derivative by a factor is the product of the other factors, which includes
  // earlier values of f. ----
  auto product_of = [&](const std::string& name) {
    Func product(name);
    product() = 1.0f;
    product() *= a(r);
    return product;
  };
  Derivative of_product = propagate_adjoints(product_of("product"));
  Buffer<float> slopes = of_product(a).realize({n});
  double worst = 0;
  std::vector<double> all(n);
  for (int k = 0; k < n; ++k) {
    double others = 1;
    for (int i = 0; i < n; ++i) others *= i == k ? 1.0 : a(i);
    worst = std::max(worst, std::abs(slopes(k) - others));
    all[k] = slopes(k);
  }
  claim(worst < 1e-6, "the gradient is correct even where a factor is 0: nothing is divided by it");

  bool kept = false;
  for (const Explanation& fact : of_product.explanations())
    kept = kept || fact.kind == Explanation::Kind::Version;
  claim(kept, "explanations() reports the stored versions");

  // ---- Limits on memory: the error names the Func and the remedy. ----
  auto refusal = [&](const AdjointOptions& options) -> std::string {
    try {
      propagate_adjoints(product_of("forbidden"), options);
    } catch (const CompileError& error) {
      return error.what();
    }
    return "";
  };
  const std::string never = refusal({.overwritten = Overwritten::Refuse});
  const std::string budget = refusal({.version_bytes = 16});  // 8 steps of 4 bytes need more
  std::printf("\n%s\n\n%s\n\n", never.c_str(), budget.c_str());
  claim(never.find("forbidden") != std::string::npos, "Overwritten::Refuse names the Func");
  claim(budget.find("16") != std::string::npos,
        "a budget that is too small is an error that states its bytes");

  // ---- If a dimension of your own holds the versions, nothing is overwritten. ----
  Var i("i");
  Func steps("steps"), last("last");
  steps(i) = 1.0f;
  steps(r + 1) = steps(r) * a(r);
  last() = steps(n);
  Buffer<float> same =
      propagate_adjoints(last, {.overwritten = Overwritten::Refuse})(a).realize({n});
  worst = 0;
  for (int k = 0; k < n; ++k) worst = std::max<double>(worst, std::abs(same(k) - slopes(k)));
  claim(worst < 1e-6, "a Func with its steps along a dimension has the same gradient");

  Picture picture("Gradient of a product by its 8 factors; the fourth is 0");
  for (int k = 0; k < n; ++k) {
    picture.cells(40 + 50 * k, 60, 40, {{all[k]}}, 0, 1.5);
    picture.text(40 + 50 * k, 130, std::to_string(all[k]).substr(0, 5));
  }
  picture.write(argc, argv, "in_place_updates");
}
