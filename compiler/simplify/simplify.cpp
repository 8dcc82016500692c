// Entry points.
#include "simplify/simplify.h"

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {
class Folder : public Rewriter {};
}  // namespace

Expr simplify(const Expr& e, const BoundsMap&) { return Folder()(e); }
Stmt simplify(const Stmt& s) { return Folder()(s); }
bool can_prove(const Expr& condition, const BoundsMap& bounds) { return is_const_true(simplify(condition, bounds)); }

}  // namespace retrograde::ir
