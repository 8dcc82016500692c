// vectorize_loops -- turn the iterations of Vectorized loops into lanes of vectors.
// In:  FlatStorage; names unique. Extents of Vectorized loops are constants, or have constant upper bounds: then
//      the lanes run under a guard. Iterations are independent, except for stores of the form f[i] = f[i] op g
//      with an associative op and a loop-invariant i.
// Out: FlatStorage without Vectorized loops; names unique. All lanes of a statement run before the next statement.
//
//   vectorized for (x, a, 8) {
//     out[x + 1] = in[x] * k         =>   out[ramp(a + 1, 1, 8)] = in[ramp(a, 1, 8)] * broadcast(k)
//     if (x < n) { f[x*2] = 0 }           f[ramp(a*2, 2, 8) if ramp(a, 1, 8) < broadcast(n)] = 0
//     s[0] = s[0] + in[x]                 s[0] = s[0] + reduce(add, in[ramp(a, 1, 8)], 1)
//     h[i(x)] = h[i(x)] + g(x)            let p = i(ramp(a, 1, 8)), t = g(ramp(a, 1, 8))
//   }                                     h[p.0] = h[p.0] + t.0; ... h[p.7] = h[p.7] + t.7
//
// Method: inner loops first. widen_expr.h widens expressions; a condition that varies becomes the predicate of
//         the loads and stores under it. Code without a vector form runs lane by lane: statements with
//         effects (print, require, assertions), loops with varying bounds, allocations with varying sizes, and
//         stores to one element that are not reductions.
//         Where lanes may hit one element, updates of elements by one operation go through the lanes in order: indices
//         and operands are vectors, the updates are scalar.
//         The whole loop stays serial when the body also reads that buffer elsewhere (argmax: two stores and
//         the comparison with the old value).
// Not done: loops with varying bounds under a mask; reductions through casts.
// Source: folklore; the mask of a branch is if-conversion (Allen, Kennedy, Porterfield & Warren 1983).
// Tests: test/golden/lower/vectorize_loops/, test/property/loop_passes_test.cpp.
#include "lower/statement_passes.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/atomic_update.h"
#include "ir/build.h"
#include "ir/memory_reads.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "lower/loops/bounded_extents.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "lower/vectors/vector_stores.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int max_lanes = 4096;
constexpr int64_t max_guarded_lanes = 256;  // for loops whose extent is unknown

// ---- lane by lane ----

// Lets and conditions around the current statement that vary with the iteration.
struct Surroundings {
  Lets lets;
  std::vector<Expr> conditions;  // together they are the mask
};

bool can_recompute(const Surroundings& around) {
  auto is_pure = [](const Expr& e) {
    return !has_effects(e) && !reads_memory(e, MemoryReads::Loads);
  };
  return std::all_of(around.lets.begin(), around.lets.end(),
                     [&](const auto& let) { return is_pure(let.second); }) &&
         std::all_of(around.conditions.begin(), around.conditions.end(), is_pure);
}

// Rewrites accesses of per-lane allocations to the elements of one lane.
Stmt with_lane_elements(const Stmt& s, const Expr& lane, const Widener& widen) {
  if (widen.wide_allocations().empty()) return s;
  const auto own = [&](const Expr& index) {
    Expr scaled = binary(Kind::Mul, index, make_const(index.type(), widen.iterations()));
    return binary(Kind::Add, scaled,
                  make_broadcast(cast_to(index.type().element_of(), lane), index.type().lanes()));
  };
  const Stmt loads = rewrite(s, [&](const Expr& e, const auto& recurse) {
    const Expr copy = map_children(e, recurse);
    const Load* n = copy.as<Load>();
    if (!n || !widen.is_wide_allocation(n->name)) return copy;
    return make_load(n->type, n->name, own(n->index), n->predicate, n->symbol);
  });
  return rewrite_statements(loads, [&](const Stmt& part, auto& all) {
    const Store* n = part.as<Store>();
    if (!n || !widen.is_wide_allocation(n->name)) return all.children(part);
    return make_store(n->name, n->value, own(n->index), n->predicate, n->symbol);
  });
}

Stmt lane_loop(const Stmt& s, const For& loop, const Surroundings& around, const Widener& widen,
               FreshNames& fresh) {
  Stmt body = make_lets(around.lets, make_if(conjunction(around.conditions), s));
  std::string lane = fresh(loop.name);
  Expr number = binary(Kind::Sub, variable(lane), loop.min);
  body = with_lane_elements(body, number, widen);
  body = copy_statement(body, fresh, {{loop.name, variable(lane)}});
  return make_for(lane, loop.min, make_const(loop.min.type(), widen.iterations()), ForType::Serial,
                  body);
}

Stmt lane_copies(const Stmt& s, const Widener& widen, FreshNames& fresh) {
  std::vector<Stmt> copies;
  for (int i = 0; i < widen.iterations(); ++i) {
    Substitution values;
    for (const auto& [name, wide] : widen.bound()) {
      values[name] = extract_iteration(wide, i, wide.type().lanes() / widen.iterations());
    }
    Stmt copy = copy_statement(with_lane_elements(s, Expr(i), widen), fresh, values);
    const Expr& mask = widen.mask();
    copies.push_back(mask.defined() ? make_if(extract_iteration(mask, i, 1), copy) : copy);
  }
  return make_block(std::move(copies));
}

// ---- one loop ----

class LoopVectorizer {
 public:
  LoopVectorizer(const For& loop, int iterations, FreshNames& fresh)
      : loop_(loop),
        fresh_(fresh),
        widen_(loop.name, loop.min, iterations, fresh),
        stores_(loop, widen_, fresh) {}

  Stmt run() {
    Stmt body = stores_.must_stay_serial() ? Stmt() : visit(loop_.body);
    if (!stores_.must_stay_serial()) return body;
    return make_for(loop_.name, loop_.min, loop_.extent, ForType::Serial, loop_.body);
  }

 private:
  // A loop over the lanes if the varying lets and conditions around the statement can be recomputed. Otherwise one
  // copy of the statement per lane, which extracts its operands from the vectors.
  Stmt lane_by_lane(const Stmt& s) {
    return can_recompute(around_) ? lane_loop(s, loop_, around_, widen_, fresh_)
                                  : lane_copies(s, widen_, fresh_);
  }

  Stmt visit(const Stmt& s) {
    if (!s.defined()) return s;
    return match(
        s, [&](const LetStmt& n) { return visit_let(s, n); },
        [&](const For& n) { return visit_for(s, n); },
        [&](const IfThenElse& n) { return visit_if(s, n); },
        [&](const Allocate& n) { return visit_allocate(s, n); },
        [&](const Store& n) { return visit_store(s, n); },
        [&](const Atomic& n) { return visit_atomic(s, n); },
        [&](const Assert& n) {
          return widen_.varies(n.condition) || widen_.varies(n.error) || widen_.mask().defined()
                     ? lane_by_lane(s)
                     : s;
        },
        [&](const Evaluate& n) {
          return has_effects(n.value) ? lane_by_lane(s) : make_evaluate(Expr(0));
        },
        [&](const StmtNode&) {
          return map_children(s, [&](const Stmt& child) { return visit(child); });
        });
  }

  // ---- lets ----

  Stmt visit_let(const Stmt& s, const LetStmt& n) {
    if (has_effects(n.value) || traces_some_lanes(n.value)) return lane_by_lane(s);
    Expr value = widen_(n.value);
    if (value.same_as(n.value)) return make_let(n.name, n.value, visit(n.body));
    around_.lets.emplace_back(n.name, n.value);
    Stmt result = is_affine(value) ? bind_ramp(n, *value.as<Ramp>()) : bind_vector(n, value);
    around_.lets.pop_back();
    return result;
  }

  static bool is_affine(const Expr& wide) {
    const Ramp* ramp = wide.as<Ramp>();
    return ramp && ramp->base.type().is_scalar() && is_const(ramp->stride);
  }

  // Binds only the ramp's base to a name, so that loads and stores still see the ramp as their index.
  Stmt bind_ramp(const LetStmt& n, const Ramp& ramp) {
    if (is_const(ramp.base) || ramp.base.as<Variable>()) {
      widen_.bind(n.name, &ramp);
      return visit(n.body);
    }
    std::string base = fresh_(n.name + ".base");
    widen_.bind(n.name, make_ramp(variable(base, ramp.base.type()), ramp.stride, ramp.lanes));
    return make_let(base, ramp.base, visit(n.body));
  }

  Stmt bind_vector(const LetStmt& n, const Expr& value) {
    widen_.bind(n.name, variable(n.name, value.type()));
    return make_let(n.name, value, visit(n.body));
  }

  // ---- control ----

  Stmt visit_for(const Stmt& s, const For& n) {
    if (widen_.varies(n.min) || widen_.varies(n.extent)) return lane_by_lane(s);
    Stmt body = visit(n.body);
    if (body.same_as(n.body)) return s;
    // Other threads cannot access vector values of this one, so a parallel loop becomes serial.
    return make_for(n.name, n.min, n.extent, n.runs == ForType::Parallel ? ForType::Serial : n.runs,
                    body);
  }

  Stmt visit_if(const Stmt& s, const IfThenElse& n) {
    if (has_effects(n.condition)) return lane_by_lane(s);
    Expr condition = widen_(n.condition);
    if (condition.same_as(n.condition))
      return make_if(n.condition, visit(n.when_true), visit(n.when_false));
    // A store in the branch may change what the condition reads, so such a condition is bound to a name.
    bool must_bind = reads_memory(condition, MemoryReads::Loads);
    std::string name = must_bind ? fresh_(loop_.name + ".mask") : "";
    Expr mask = must_bind ? variable(name, condition.type()) : condition;
    Stmt branches =
        make_block({masked_branch(n.condition, mask, n.when_true),
                    masked_branch(logical_not(n.condition), logical_not(mask), n.when_false)});
    return must_bind ? make_let(name, condition, branches) : branches;
  }

  Stmt masked_branch(const Expr& scalar_condition, const Expr& condition, const Stmt& branch) {
    if (!branch.defined()) return branch;
    Expr outer = widen_.mask();
    Expr mask = outer.defined() ? binary(Kind::And, outer, condition) : condition;
    around_.conditions.push_back(scalar_condition);
    widen_.set_mask(mask);
    Stmt body = visit(branch);
    widen_.set_mask(outer);
    around_.conditions.pop_back();
    if (!body.defined() || !needs_an_active_lane(body)) return body;
    return make_if(make_vector_reduce(Kind::Or, mask, 1), body);
  }

  // Whether the widened branch may run only if some lane is active: unpredicated accesses would touch memory for no
  // lane, and loops would run in vain.
  static bool needs_an_active_lane(const Stmt& branch) {
    return any_node(
        branch, [](const Load& n) { return !n.predicate.defined(); },
        [](const Store& n) { return !n.predicate.defined(); }, [](const For&) { return true; });
  }

  Stmt visit_allocate(const Stmt& s, const Allocate& n) {
    if (widen_.varies(n.elements)) return lane_by_lane(s);
    widen_.bind_allocation(n.name);
    Expr elements =
        binary(Kind::Mul, n.elements, make_const(n.elements.type(), widen_.iterations()));
    return make_allocate(n.name, n.type, n.memory, elements, visit(n.body));
  }

  // Trace events have no mask, so under a mask they are emitted lane by lane.
  bool traces_some_lanes(const Expr& e) {
    return widen_.mask().defined() &&
           any_node(e, [](const Call& call) { return call.is_op(Op::trace); });
  }

  // ---- stores ----

  Stmt visit_store(const Stmt& s, const Store& n) {
    if (has_effects(n.value) || has_effects(n.index) || traces_some_lanes(n.value))
      return lane_by_lane(s);
    const Stmt stored = stores_.store(s, n);
    return stored.defined() ? stored : lane_by_lane(s);
  }

  // A single operation on the element stays a vector. Anything else runs lane by lane.
  Stmt visit_atomic(const Stmt& s, const Atomic& n) {
    const Store* store = n.body.as<Store>();
    if (store && widen_.is_wide_allocation(store->name)) return visit_store(n.body, *store);
    if (!store || !find_atomic_update(*store) || has_effects(store->value)) return lane_by_lane(s);
    if (!widen_.varies(store->index)) return make_atomic(n.name, visit_store(n.body, *store));
    return make_atomic(n.name, stores_.atomic_update(*store));
  }

  const For& loop_;
  FreshNames& fresh_;
  Widener widen_;
  VectorStores stores_;
  Surroundings around_;
};

// ---- all loops ----

int widest_vector(const Stmt& s) {
  int lanes = 1;
  walk(
      s, [&](const Expr& e) { return lanes = std::max(lanes, e.type().lanes()), true; },
      [](const Stmt&) { return true; });
  return lanes;
}

Stmt vectorized(const For& loop, int64_t extent, FreshNames& fresh) {
  if (extent <= 0) return {};
  if (extent == 1) return substitute(loop.body, loop.name, loop.min);
  int64_t lanes = extent * widest_vector(loop.body);
  if (lanes > max_lanes) {
    user_error("vectorize " + describe_loop(loop.name),
               text("vectors have at most ", max_lanes, " lanes"), text("this loop needs ", lanes),
               "Split the variable, and vectorize the inner part");
  }
  return LoopVectorizer(loop, static_cast<int>(extent), fresh).run();
}

class Vectorizer : public BoundedExtents {
 public:
  explicit Vectorizer(const Stmt& s) : fresh_(s) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    const Stmt inner = parts(s);
    const For* loop = inner.as<For>();
    if (!loop || loop->runs != ForType::Vectorized) return inner;
    if (const auto extent = as_const_int(simplify(loop->extent)))
      return vectorized(*loop, *extent, fresh_);
    const auto most = largest(loop->extent, max_guarded_lanes);
    if (!most) refuse(*loop);
    const Stmt guarded = with_all_lanes(*loop, *most);
    return vectorized(*guarded.as<For>(), *most, fresh_);
  }

 private:
  FreshNames fresh_;

  // The loop with `lanes` iterations, of which those beyond the extent do nothing.
  static Stmt with_all_lanes(const For& loop, int64_t lanes) {
    const Expr runs = variable(loop.name, loop.min.type()) < loop.min + loop.extent;
    return make_for(loop.name, loop.min, make_const(loop.extent.type(), lanes), loop.runs,
                    make_if(runs, loop.body));
  }

  [[noreturn]] static void refuse(const For& loop) {
    user_error("vectorize " + describe_loop(loop.name),
               "the extent of a vectorized loop must be a constant, or have a constant above it",
               text("its extent is ", loop.extent),
               "Vectorize the inner variable of a split by a constant, or promise the extent "
               "with bound()");
  }
};

}  // namespace

Stmt vectorize_loops(const Stmt& s) {
  if (!has_loops(s, ForType::Vectorized)) return s;
  const Stmt result = Vectorizer(s)(s);
  return result.defined() ? result : make_evaluate(Expr(0));
}

}  // namespace retrograde::lower
