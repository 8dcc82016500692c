// unroll_loops -- copy the body of every Unrolled loop once per iteration.
// In:  any phase; names unique; extents of Unrolled loops are constants, or have constant upper bounds that follow from
//      their value or from the conditions around the loop.
// Out: the same phase without Unrolled loops; the same stores in the same order; names unique.
//
//   unrolled for (x, a, 2) {          f[a] = g[a]
//     f[x] = g[x]               =>    f[a + 1] = g[a + 1]
//   }
//
//   unrolled for (x, a, min(n, 2)) {  if (0 < min(n, 2)) f[a] = g[a]
//     f[x] = g[x]               =>    if (1 < min(n, 2)) f[a + 1] = g[a + 1]
//   }
//
// With HL_PERMIT_FAILED_UNROLL=1 in the environment, a loop whose extent has no constant upper bound becomes serial;
// otherwise it is an error.
//
// Method: inner loops first; copies after the first get fresh names for everything that they bind. In each copy,
//         select(x == 0, .., select(x == 1, ..)) is replaced by its arm, found by table lookup (choice_arms.h).
//         Upper bounds of extents: bounded_extents.h.
// Not done: limiting the size of the result; the schedule requests the copies.
// Source: folklore. Tests: test/golden/lower/unroll_loops/.
#include "lower/statement_passes.h"

#include <cstdlib>
#include <optional>
#include <string_view>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "lower/loops/bounded_extents.h"
#include "lower/loops/choice_arms.h"
#include "lower/nests/copy_statement.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int64_t most_guarded = 256;  // copies of a loop whose extent is unknown

// As in Halide: lets schedules for constant extents compile for others.
bool may_stay_loops() {
  const char* text = std::getenv("HL_PERMIT_FAILED_UNROLL");
  return text && std::string_view(text) == "1";
}

class Unroller : public BoundedExtents {
 public:
  explicit Unroller(const Stmt& s) : fresh_(s) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    Stmt inner = parts(s);
    const For* loop = inner.as<For>();
    if (!loop || loop->runs != ForType::Unrolled) return inner;
    if (auto extent = as_const_int(simplify(loop->extent))) return unrolled(*loop, *extent, false);
    if (auto most = largest(loop->extent, most_guarded)) return unrolled(*loop, *most, true);
    if (may_stay_loops())
      return make_for(loop->name, loop->min, loop->extent, ForType::Serial, loop->body,
                      loop->partition);
    user_error(
        "unroll " + describe_loop(loop->name),
        "the extent of an unrolled loop must be a constant, or have a constant above it",
        text("its extent is ", loop->extent),
        "Unroll the inner variable of a split by a constant, promise the extent with bound(), or "
        "say under which condition it is small: specialize(extent <= 4)");
  }

 private:
  FreshNames fresh_;

  Stmt unrolled(const For& loop, int64_t extent, bool is_guarded) {
    std::vector<Stmt> copies;
    ChoiceArms arms(loop.name);
    const bool chooses = arms.has_any(loop.body);
    for (int64_t i = 0; i < extent; ++i) {
      Expr value = binary(Kind::Add, loop.min, make_const(loop.min.type(), i));
      const auto number = chooses ? as_const_int(value) : std::nullopt;
      const Stmt body = number ? arms.choose(loop.body, *number) : loop.body;
      Substitution iteration{{loop.name, value}};
      Stmt copy = i == 0 ? substitute(body, iteration) : copy_statement(body, fresh_, iteration);
      const Expr runs = make_const(loop.extent.type(), i) < loop.extent;
      copies.push_back(is_guarded ? make_if(runs, copy) : copy);
    }
    return copies.empty() ? make_evaluate(0) : make_block(std::move(copies));
  }
};

}  // namespace

Stmt unroll_loops(const Stmt& s) { return has_loops(s, ForType::Unrolled) ? Unroller(s)(s) : s; }

}  // namespace retrograde::lower
