#include "frontend/func.h"

namespace retrograde {

Func Stage::rfactor(const std::vector<std::pair<RVar, Var>>&) {
  unsupported("factor the reduction of " + quoted(name()), "rfactor is being built");
}
Func Stage::rfactor(const RVar& r, const Var& v) { return rfactor({{r, v}}); }

}  // namespace retrograde
