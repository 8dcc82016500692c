#include "autoschedule/long_sums.h"

#include <algorithm>
#include <string>
#include <utility>

#include "autoschedule/new_loop.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/loop_level.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t least_of_block = 64, most_of_block = 256;  // terms that a lane adds

int64_t iterations_of(const ReductionVariable& r, int lanes) {
  const int64_t extent = as_const_int(simplify(r.extent)).value_or(INT32_MAX);
  return (extent + lanes - 1) / lanes;
}

// That a lane adds in all, or the given number if there are more.
int64_t terms_of(const std::vector<ReductionVariable>& loops, int lanes, int64_t most) {
  int64_t terms = 1;
  for (const ReductionVariable& r : loops) {
    terms *= std::max<int64_t>(iterations_of(r, &r == &loops[0] ? lanes : 1), 1);
    if (terms > most) return most;
  }
  return terms;
}

// About as many as there are blocks: the error is that of both chains.
int64_t terms_of_block(const std::vector<ReductionVariable>& loops, int lanes) {
  const int64_t terms = terms_of(loops, lanes, most_of_block * most_of_block);
  int64_t block = least_of_block;
  while (4 * block * block <= terms) block *= 2;
  return std::min(block, most_of_block);
}

// Whether iterations of the reduction write different elements.
bool moves(const Definition& update) {
  return std::ranges::any_of(update.args, [&](const Expr& arg) {
    return std::ranges::any_of(
        update.rvars, [&](const ReductionVariable& r) { return uses_variable(arg, r.var); });
  });
}

// The loops over blocks, innermost first.
std::vector<RVar> cut(const FuncContents& f, int index, Stage& stage,
                      const std::vector<ReductionVariable>& loops, int lanes) {
  std::vector<RVar> blocks;
  const int64_t most = terms_of_block(loops, lanes);
  int64_t terms = 1;  // of a block so far
  for (const ReductionVariable& r : loops) {
    const int64_t iterations = iterations_of(r, &r == &loops[0] ? lanes : 1);
    if (blocks.empty() && terms * iterations <= most) {
      terms *= std::max<int64_t>(iterations, 1);
      continue;
    }
    RVar block(r.var);
    const int64_t inside = blocks.empty() ? most / terms : 1;
    if (inside > 1) {
      block = RVar(new_loop(f, index, "block"));
      stage.split(RVar(r.var), block, RVar(r.var), static_cast<int>(inside),
                  TailStrategy::GuardWithIf);
    }
    blocks.push_back(block);
  }
  return blocks;
}

}  // namespace

bool is_long_sum(const FuncContents& f, const Definition& update,
                 const std::vector<ReductionVariable>& loops, int lanes, int64_t most) {
  if (update.values.size() != 1 || !f.types[0].is_float() || f.types[0].bits() >= 64 ||
      terms_of(loops, lanes, most + 1) <= most || moves(update))
    return false;
  const Expr value = without_lets(update.values[0]);
  if (value.kind() != Kind::Add && value.kind() != Kind::Sub) return false;
  const auto* n = value.as<Binary>();
  return (is_old_value(n->a, f, update) && !calls(n->b, &f)) ||
         (value.kind() == Kind::Add && is_old_value(n->b, f, update) && !calls(n->a, &f));
}

FuncPtr add_in_blocks(const FuncPtr& f, int index, const std::vector<ReductionVariable>& loops,
                      int lanes) {
  Stage stage(f, index);
  const std::vector<RVar> blocks = cut(*f, index, stage, loops, lanes);
  std::vector<std::pair<RVar, Var>> preserved;
  for (const RVar& block : blocks) {
    const std::string name = graph::without_numbers(block.name());
    preserved.emplace_back(block, Var(new_loop(*f, index, name.substr(name.rfind('.') + 1) + "s")));
  }
  Func sums = stage.rfactor(preserved);
  sums.compute_at(retrograde::LoopLevel(Func(f), blocks[0], index));
  return sums.function();
}

}  // namespace retrograde::autoschedule
