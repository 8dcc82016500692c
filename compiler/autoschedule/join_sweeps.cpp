#include "autoschedule/join_sweeps.h"

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_set>

#include "autoschedule/only_reader.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/wrappers.h"
#include "ir/equal.h"
#include "ir/lets.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

constexpr size_t sweeps_back = 8;  // sweeps before this one

struct Sweep {
  FuncPtr func;
  int stage;
  std::vector<Expr> looked_up;  // calls: what is dear to load
  bool is_joined = false;

  const Definition& definition() const { return func->stage(stage); }
  const std::vector<Dim>& loops() const { return definition().schedule.dims; }
};

// Whether loading it takes longer than what is done with it: from places that data decide, lane by
// lane, or from memory.
bool is_dear(const Call& call, const SizeEstimate& sizes) {
  const FuncPtr callee = call.call_type == CallType::Func ? func_of(call) : nullptr;
  return (callee && sizes.bytes(*callee) >= sizes.machine().last_cache_bytes()) ||
         std::any_of(call.args.begin(), call.args.end(),
                     [](const Expr& place) { return reads_memory(place, MemoryReads::Functions); });
}

std::vector<Expr> looked_up_in(const FuncContents& f, const Definition& stage,
                               const SizeEstimate& sizes) {
  std::vector<Expr> result;
  for_each_expr(stage, [&](const Expr& root) {
    walk(without_lets(root), [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (!call || call->call_type == CallType::Operator || call->symbol.raw() == &f) return true;
      const bool is_known = std::any_of(result.begin(), result.end(),
                                        [&](const Expr& other) { return equal(e, other); });
      if (!is_known && is_dear(*call, sizes)) result.push_back(e);
      return true;
    });
  });
  return result;
}

// Whether the loops are alike, from the outermost to the innermost.
bool has_same_loops(const Sweep& a, const Sweep& b) {
  return std::equal(a.loops().begin(), a.loops().end(), b.loops().begin(), b.loops().end(),
                    [](const Dim& x, const Dim& y) {
                      return x.is_reduction == y.is_reduction && x.runs == y.runs &&
                             x.partition == y.partition && (x.is_reduction || x.var == y.var);
                    });
}

bool has_same_domain(const Sweep& a, const Sweep& b, const SizeEstimate& sizes) {
  const FuncContents &f = *a.func, &g = *b.func;
  if (f.args != g.args) return false;
  for (size_t d = 0; d < f.args.size(); ++d) {
    const auto extent = sizes.extent(f, d);
    const bool is_pure = is_pure_position(f, a.definition(), d);
    if (!extent || extent != sizes.extent(g, d) || !is_pure ||
        !is_pure_position(g, b.definition(), d))
      return false;
  }
  const auto &over = a.definition().rvars, &also = b.definition().rvars;
  return std::equal(over.begin(), over.end(), also.begin(), also.end(),
                    [](const ReductionVariable& r, const ReductionVariable& s) {
                      return equal(r.min, s.min) && equal(r.extent, s.extent);
                    });
}

// Whether most of what `b` looks up is what `a` does.
bool look_up_the_same(const Sweep& a, const Sweep& b) {
  Substitution names;
  for (size_t i = 0; i < b.definition().rvars.size(); ++i)
    names[b.definition().rvars[i].var] = variable(a.definition().rvars[i].var);
  const auto by_name = [](const Sweep& sweep) {
    Substitution plain;
    for (const ReductionVariable& r : sweep.definition().rvars) plain[r.var] = variable(r.var);
    return plain;
  };
  std::vector<Expr> known;
  for (const Expr& e : a.looked_up) known.push_back(substitute(e, by_name(a)));
  const auto shared = std::count_if(b.looked_up.begin(), b.looked_up.end(), [&](const Expr& e) {
    const Expr renamed = substitute(e, names);
    return std::any_of(known.begin(), known.end(),
                       [&](const Expr& other) { return equal(renamed, other); });
  });
  return 2 * static_cast<size_t>(shared) > b.looked_up.size();
}

bool depends_on(const FuncPtr& f, const FuncPtr& other) {
  const std::vector<FuncPtr> order = topological_order({f});
  return std::find(order.begin(), order.end(), other) != order.end();
}

// The innermost loop around vectors and what is unrolled.
std::optional<VarOrRVar> innermost_loop(const Sweep& sweep) {
  for (const Dim& loop : sweep.loops()) {
    if (loop.runs != ForType::Vectorized && loop.runs != ForType::Unrolled)
      return VarOrRVar(loop.var, loop.is_reduction);
  }
  return std::nullopt;
}

struct SharedLoops {
  Sweep with, joining;
  VarOrRVar innermost;
};

std::vector<SharedLoops> shared_loops(const std::vector<FuncPtr>& outputs,
                                      const std::vector<FuncPtr>& funcs,
                                      const SizeEstimate& sizes) {
  std::unordered_set<std::string> hosts;  // of what is computed in their loops
  for (const FuncPtr& f : functions_of(outputs)) hosts.insert(f->schedule.compute_level.func);
  std::vector<Sweep> sweeps;
  for (const FuncPtr& f : funcs) {
    if (!is_at_root(*f) || hosts.contains(f->name)) continue;
    if (f->stage_count() != 2 || f->updates[0].rvars.empty()) continue;
    Sweep sweep{f, 1, looked_up_in(*f, f->updates[0], sizes)};
    if (!sweep.looked_up.empty()) sweeps.push_back(std::move(sweep));
  }
  std::vector<SharedLoops> result;
  for (size_t i = 1; i < sweeps.size(); ++i) {
    for (size_t k = i > sweeps_back ? i - sweeps_back : 0; k < i && !sweeps[i].is_joined; ++k) {
      Sweep &with = sweeps[k], &joining = sweeps[i];
      if (with.is_joined || !has_same_loops(with, joining) ||
          !has_same_domain(with, joining, sizes) || !look_up_the_same(with, joining))
        continue;
      const auto level = innermost_loop(with);
      if (!level || depends_on(joining.func, with.func)) continue;
      result.push_back({with, joining, *level});
      with.is_joined = joining.is_joined = true;
    }
  }
  return result;
}

}  // namespace

std::unordered_set<const Symbol*> sweeps_that_join(const std::vector<FuncPtr>& outputs,
                                                   const std::vector<FuncPtr>& funcs,
                                                   const SizeEstimate& sizes) {
  std::unordered_set<const Symbol*> result;
  for (const SharedLoops& loops : shared_loops(outputs, funcs, sizes))
    result.insert({loops.with.func.get(), loops.joining.func.get()});
  return result;
}

void join_sweeps(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& funcs,
                 const SizeEstimate& sizes) {
  for (const auto& [with, joining, innermost] : shared_loops(outputs, funcs, sizes))
    Stage(joining.func, joining.stage).compute_with(Stage(with.func, with.stage), innermost);
}

}  // namespace retrograde::autoschedule
