// Differentiates the access patterns of the table with Retrograde, and computes the expected gradients in its
// interpreter.
#include <retrograde/retrograde.h>

#include "gradient/access_table/side.h"
#include "ir/visit.h"
#include "simplify/simplify.h"
#include "testing/interpreter.h"

namespace access_table {
namespace in_retrograde {
using namespace retrograde;

static Target jit_target() { return get_jit_target_from_environment(); }
static Func adjoint_of(const Func& out, const Func& in, const Func& seed, const Region& region) {
  return propagate_adjoints(out, seed, region)(in);
}
static bool depends_on_reduction(const Expr& e) {
  bool found = false;
  ir::walk(e, [&](const Expr& node) {
    const auto* v = node.as<ir::Variable>();
    const auto* call = node.as<ir::Call>();
    found |= v && dynamic_cast<graph::ReductionDomainContents*>(v->symbol.raw());
    found |= call && call->call_type != ir::CallType::Operator;
    return !found;
  });
  return found;
}
static long iterations_of(const RVar& r) {
  auto n = ir::as_const_int(simplification::simplify(r.extent()));
  return n ? static_cast<long>(*n) : -1;
}

#include "gradient/access_table/patterns.h"
// Must follow the inclusion of the patterns.
#include "gradient/access_table/common.h"

static std::vector<double> realized(const Func& f, const std::vector<int>& extents) {
  oracle::Region region{std::vector<int>(extents.size(), 0), extents};
  oracle::Array array = oracle::Interpreter().realize(f.function(), region).front();
  std::vector<double> values;
  for (const oracle::Value& v : array.values) values.push_back(v.scalar.as_double());
  return values;
}
}  // namespace in_retrograde

Outcome differentiate_in_retrograde(size_t pattern) {
  return in_retrograde::differentiate_safely(in_retrograde::patterns().at(pattern));
}

std::vector<float> gradient_by_columns(size_t pattern) {
  using namespace in_retrograde;
  const Pattern p = patterns().at(pattern);
  Buffer<float> image(p.description.input);
  image.fill(0.0f);
  Func out = p.build(wrapped(image));
  std::vector<double> seed = realized(seed_of(p.description.output), p.description.output);
  std::vector<float> gradient;
  for (float& element : image) {
    element = 1.0f;
    std::vector<double> column = realized(out, p.description.output);
    element = 0.0f;
    double sum = 0;
    for (size_t i = 0; i < column.size(); ++i) sum += column[i] * seed[i];
    gradient.push_back(static_cast<float>(sum));
  }
  return gradient;
}

}  // namespace access_table
