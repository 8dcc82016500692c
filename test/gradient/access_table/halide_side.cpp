// Differentiates the access patterns of the table with Halide 14.
#include <Halide.h>

#include "gradient/access_table/side.h"

namespace access_table {
namespace in_halide {
using namespace Halide;

// Halide 14 takes any machine with AVX512-BF16 for a Sapphire Rapids, and emits instructions that other machines lack.
static Target jit_target() {
  return get_jit_target_from_environment().without_feature(Target::AVX512_SapphireRapids);
}
static Func adjoint_of(const Func& out, const Func& in, const Func& seed, const Region& region) {
  return propagate_adjoints(out, seed, region)(in);
}

class FindsReduction : public Internal::IRVisitor {
 public:
  bool found = false;

 private:
  using IRVisitor::visit;
  void visit(const Internal::Variable* v) override { found |= v->reduction_domain.defined(); }
  void visit(const Internal::Call* call) override {
    found |= call->call_type == Internal::Call::Halide || call->call_type == Internal::Call::Image;
    IRVisitor::visit(call);
  }
};
static bool depends_on_reduction(const Expr& e) {
  FindsReduction finder;
  e.accept(&finder);
  return finder.found;
}
static long iterations_of(const RVar& r) {
  const int64_t* n = Internal::as_const_int(Internal::simplify(r.extent()));
  return n ? static_cast<long>(*n) : -1;
}

#include "gradient/access_table/patterns.h"
// Must follow the inclusion of the patterns.
#include "gradient/access_table/common.h"
}  // namespace in_halide

std::vector<Description> descriptions() {
  std::vector<Description> result;
  for (const in_halide::Pattern& p : in_halide::patterns()) result.push_back(p.description);
  return result;
}

Outcome differentiate_in_halide(size_t pattern) {
  return in_halide::differentiate_safely(in_halide::patterns().at(pattern));
}

}  // namespace access_table
