// unroll_loops -- copy the body of every Unrolled loop once per iteration.
// In:  any phase; names unique; extents of Unrolled loops are constants.
// Out: the same phase without Unrolled loops; the same stores in the same order; names unique.
//
//   unrolled for (x, a, 2) {          f[a] = g[a]
//     f[x] = g[x]               =>    f[a + 1] = g[a + 1]
//   }
//
// Method: inner loops first; copies after the first get fresh names for everything that they bind.
// Not done: a limit on the size of the result: the user asked for the copies.
// Source: folklore. Tests: test/golden/lower/unroll_loops/.
#include "lower/unroll_loops.h"

#include <optional>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "lower/copy_statement.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

class Unroller : public Rewriter {
 public:
  explicit Unroller(const Stmt& s) : fresh_(s) {}

 protected:
  Expr rewrite(const Expr& e) override { return e; }  // statements only

  Stmt rewrite(const Stmt& s) override {
    Stmt inner = children(s);
    const For* loop = inner.as<For>();
    if (!loop || loop->for_type != ForType::Unrolled) return inner;
    auto extent = as_const_int(simplify(loop->extent));
    if (!extent) {
      user_error(
          "unroll " + describe_loop(loop->name),
          "the extent of an unrolled loop must be a constant", text("its extent is ", loop->extent),
          "Unroll the inner variable of a split by a constant, or promise the extent with bound()");
    }
    return unrolled(*loop, *extent);
  }

 private:
  Stmt unrolled(const For& loop, int64_t extent) {
    std::vector<Stmt> copies;
    for (int64_t i = 0; i < extent; ++i) {
      Expr value = binary(Kind::Add, loop.min, make_const(loop.min.type(), i));
      Substitution iteration{{loop.name, value}};
      copies.push_back(i == 0 ? substitute(loop.body, iteration)
                              : copy_statement(loop.body, fresh_, iteration));
    }
    return make_block(std::move(copies));
  }

  FreshNames fresh_;
};

}  // namespace

Stmt unroll_loops(const Stmt& s) {
  bool has_unrolled = false;
  walk(
      s, [](const Expr&) { return false; },
      [&](const Stmt& node) {
        const For* loop = node.as<For>();
        has_unrolled |= loop && loop->for_type == ForType::Unrolled;
        return !has_unrolled;
      });
  return has_unrolled ? Unroller(s)(s) : s;
}

}  // namespace retrograde::ir
