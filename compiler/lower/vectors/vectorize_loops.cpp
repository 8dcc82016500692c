// vectorize_loops -- turn the iterations of Vectorized loops into lanes of vectors.
// In:  FlatStorage; names unique; extents of Vectorized loops are constants; iterations are
//      independent, except for stores of the form f[i] = f[i] op g with an associative op and an i
//      that does not vary.
// Out: FlatStorage without Vectorized loops; names unique. All lanes of a statement run before the
//      next statement.
//
//   vectorized for (x, a, 8) {
//     out[x + 1] = in[x] * k         =>   out[ramp(a + 1, 1, 8)] = in[ramp(a, 1, 8)] * broadcast(k)
//     if (x < n) { f[x*2] = 0 }           f[ramp(a*2, 2, 8) if ramp(a, 1, 8) < broadcast(n)] = 0
//     s[0] = s[0] + in[x]                 s[0] = s[0] + reduce(add, in[ramp(a, 1, 8)], 1)
//     h[i(x)] = h[i(x)] + g(x)            let p = i(ramp(a, 1, 8)), t = g(ramp(a, 1, 8))
//   }                                     h[p.0] = h[p.0] + t.0; ... h[p.7] = h[p.7] + t.7
//
// Method: inner loops first. Expressions are widened by widen_expr.h; a condition that varies
//         becomes the predicate of the loads and stores under it. What has no vector form runs lane
//         by lane: statements with effects (print, require, assertions), loops whose bounds vary,
//         allocations whose size varies, stores to one element that are no reduction.
//         Where lanes may hit one element, updates of elements by one operation go through the
//         lanes in order: places and operands are vectors, the elements are not.
//         The whole loop stays a serial one when the body reads that buffer elsewhere (argmax: two
//         stores and the comparison of the old value).
// Not done: loops with varying bounds under a mask; reductions through casts.
// Source: folklore; the mask of a branch is Allen, Kennedy, Porterfield & Warren 1983
//         (if-conversion).
// Tests: test/golden/lower/vectorize_loops/, test/property/loop_passes_test.cpp.
#include "lower/statement_passes.h"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include "diagnostics/error.h"
#include "ir/atomic_update.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/memory_reads.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "lower/vectors/reductions.h"
#include "lower/vectors/widen_expr.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

constexpr int max_lanes = 4096;

// ---- facts of a loop body ----

struct BodyFacts {
  std::unordered_map<std::string, int>
      loads;  // nodes that load from a buffer, counted once per statement
  std::unordered_set<std::string> allocated;  // inside the body
  std::unordered_map<std::string, int> stores;
  std::unordered_set<std::string> produced;  // Funcs computed inside the body
  // Of stores f[i] = f[i] op g: their loads of f, and which operations there are.
  std::unordered_map<std::string, int> update_loads;
  std::unordered_map<std::string, std::set<std::pair<Kind, Op>>> update_operations;
};

void count_loads(const Expr& e, std::unordered_map<std::string, int>& loads) {
  walk(e, [&](const Load& load) { ++loads[load.name]; });
}

int own_loads(const Store& n) {
  std::unordered_map<std::string, int> loads;
  count_loads(n.value, loads);
  count_loads(n.index, loads);
  return loads[n.name];
}

void find_store_facts(const Store& n, BodyFacts& facts) {
  ++facts.stores[n.name];
  if (auto update = find_atomic_update(n)) {
    facts.update_loads[n.name] += own_loads(n);
    facts.update_operations[n.name].insert({update->kind, update->op});
  }
}

void find_facts(const Stmt& s, BodyFacts& facts) {
  if (!s.defined()) return;
  if (const Allocate* a = s.as<Allocate>()) facts.allocated.insert(a->name);
  if (const Store* store = s.as<Store>()) find_store_facts(*store, facts);
  const ProducerConsumer* p = s.as<ProducerConsumer>();
  if (p && p->produces) facts.produced.insert(p->name);
  for_each_child(
      s, [&](const Expr& e) { count_loads(e, facts.loads); },
      [&](const Stmt& child) { find_facts(child, facts); });
}

// A Func computed in every iteration into storage that all of them share: where their regions
// overlap, an iteration initializes again what another has updated, so they must not be
// interleaved.
bool recomputes_shared_updates(const BodyFacts& facts) {
  for (const auto& [buffer, count] : facts.stores) {
    if (count < 2 || facts.allocated.count(buffer)) continue;
    if (facts.produced.count(buffer) || facts.produced.count(buffer.substr(0, buffer.rfind('.'))))
      return true;
  }
  return false;
}

// Of scalars, by an operator that vectors are reduced by.
std::optional<UpdateChain> find_reduction(const Store& store) {
  auto chain = find_update_chain(store);
  const bool is_reduced =
      chain && chain->kind != Kind::Call && !chain->own.as<Load>()->predicate.defined();
  return is_reduced ? chain : std::nullopt;
}

// ---- one loop ----

class LoopVectorizer {
 public:
  LoopVectorizer(const For& loop, int iterations, FreshNames& fresh)
      : loop_(loop),
        iterations_(iterations),
        fresh_(fresh),
        widen_(loop.name, loop.min, iterations, fresh) {
    find_facts(loop.body, facts_);
    must_stay_serial_ = recomputes_shared_updates(facts_);
  }

  Stmt run() {
    Stmt body = must_stay_serial_ ? Stmt() : visit(loop_.body);
    if (!must_stay_serial_) return body;
    return make_for(loop_.name, loop_.min, loop_.extent, ForType::Serial, loop_.body);
  }

 private:
  bool varies(const Expr& e) { return e.defined() && !widen_(e).same_as(e); }

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
          return varies(n.condition) || varies(n.error) || widen_.mask().defined() ? lane_by_lane(s)
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
    if (has_effects(n.value) || tells_of_some_lanes(n.value)) return lane_by_lane(s);
    Expr value = widen_(n.value);
    if (value.same_as(n.value)) return make_let(n.name, n.value, visit(n.body));
    lets_.emplace_back(n.name, n.value);
    Stmt result = is_affine(value) ? bind_ramp(n, *value.as<Ramp>()) : bind_vector(n, value);
    lets_.pop_back();
    return result;
  }

  static bool is_affine(const Expr& wide) {
    const Ramp* ramp = wide.as<Ramp>();
    return ramp && ramp->base.type().is_scalar() && is_const(ramp->stride);
  }

  // Keeps the ramp visible to the loads and stores that it indexes: only its base is bound.
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
    if (varies(n.min) || varies(n.extent)) return lane_by_lane(s);
    Stmt body = visit(n.body);
    if (body.same_as(n.body)) return s;
    // Vectors are not handed to other threads.
    return make_for(n.name, n.min, n.extent, n.runs == ForType::Parallel ? ForType::Serial : n.runs,
                    body);
  }

  Stmt visit_if(const Stmt& s, const IfThenElse& n) {
    if (has_effects(n.condition)) return lane_by_lane(s);
    Expr condition = widen_(n.condition);
    if (condition.same_as(n.condition))
      return make_if(n.condition, visit(n.when_true), visit(n.when_false));
    bool must_bind = reads_memory(
        condition,
        MemoryReads::Loads);  // a store of the branch may change what the condition reads
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
    conditions_.push_back(scalar_condition);
    widen_.set_mask(mask);
    Stmt body = visit(branch);
    widen_.set_mask(outer);
    conditions_.pop_back();
    if (!body.defined() || !needs_an_active_lane(body)) return body;
    return make_if(make_vector_reduce(Kind::Or, mask, 1), body);
  }

  // In what a branch has become: accesses that did not vary have no predicate, and loops are not
  // worth running for nobody.
  static bool needs_an_active_lane(const Stmt& branch) {
    return any_node(
        branch, [](const Load& n) { return !n.predicate.defined(); },
        [](const Store& n) { return !n.predicate.defined(); }, [](const For&) { return true; });
  }

  Stmt visit_allocate(const Stmt& s, const Allocate& n) {
    if (varies(n.elements)) return lane_by_lane(s);
    widen_.bind_allocation(n.name);
    Expr elements = binary(Kind::Mul, n.elements, make_const(n.elements.type(), iterations_));
    return make_allocate(n.name, n.type, n.memory, elements, visit(n.body));
  }

  // An event has no mask.
  bool tells_of_some_lanes(const Expr& e) {
    return widen_.mask().defined() &&
           any_node(e, [](const Call& call) { return call.is_op(Op::trace); });
  }

  // ---- stores ----

  Stmt visit_store(const Stmt& s, const Store& n) {
    if (has_effects(n.value) || has_effects(n.index) || tells_of_some_lanes(n.value))
      return lane_by_lane(s);
    int lanes = n.index.type().lanes();
    if (widen_.is_wide_allocation(n.name)) {
      return make_store(n.name, widen_.spread(n.value), widen_.index_in_wide_allocation(n.index),
                        widen_.masked(n.predicate, lanes), n.symbol);
    }
    if (varies(n.index)) {
      Expr index = widen_(n.index);
      const bool may_meet = !hits_each_element_once(index);
      if (may_meet) {
        if (auto update = as_plain_update(n)) return update_in_order(n, index, *update);
        require_no_load(n.name, 0);
      }
      return make_store(n.name, widen_.spread(n.value), index, widen_.masked(n.predicate, lanes),
                        n.symbol);
    }
    if (auto reduction = find_reduction(n)) return store_reduction(s, n, *reduction);
    require_no_load(n.name, 0);
    bool is_same = !varies(n.value) && !varies(n.predicate);
    return is_same ? s : lane_by_lane(s);  // the last lane wins
  }

  // f[i] = f[i] op g, where nothing else in the body reads f but updates by the same operation.
  std::optional<AtomicUpdate> as_plain_update(const Store& n) const {
    if (!n.index.type().is_scalar() || n.predicate.defined() || !n.value.type().is_scalar())
      return std::nullopt;
    auto update = find_atomic_update(n);
    if (!update || facts_.loads.at(n.name) > facts_.update_loads.at(n.name) ||
        facts_.update_operations.at(n.name).size() > 1)
      return std::nullopt;
    return update;
  }

  // Places and operands are vectors; the elements change one after the other, in the order of the
  // lanes, as several may be the same.
  Stmt update_in_order(const Store& n, const Expr& index, const AtomicUpdate& update) {
    Expr operand = widen_.spread(update.operand);
    const std::string places = fresh_(loop_.name + ".places"),
                      terms = fresh_(loop_.name + ".terms");
    std::vector<Stmt> stores;
    for (int i = 0; i < iterations_; ++i) {
      Expr place = extract_iteration(variable(places, index.type()), i, 1);
      Expr term = extract_iteration(variable(terms, operand.type()), i, 1);
      Expr old = make_load(n.value.type(), n.name, place, {}, n.symbol);
      Stmt store = make_store(n.name, updated(update, old, term), place, {}, n.symbol);
      const Expr& mask = widen_.mask();
      stores.push_back(mask.defined() ? make_if(extract_iteration(mask, i, 1), store) : store);
    }
    return make_let(places, index, make_let(terms, operand, make_block(std::move(stores))));
  }

  // One operation on the element stays a vector, whose lanes may hit one element: it is stored lane
  // by lane. Anything else runs lane by lane altogether.
  Stmt visit_atomic(const Stmt& s, const Atomic& n) {
    const Store* store = n.body.as<Store>();
    if (store && widen_.is_wide_allocation(store->name)) return visit_store(n.body, *store);
    if (!store || !find_atomic_update(*store) || has_effects(store->value)) return lane_by_lane(s);
    if (!varies(store->index)) return make_atomic(n.name, visit_store(n.body, *store));
    require_no_load(store->name, own_loads(*store));
    const int lanes = store->index.type().lanes();
    return make_atomic(n.name,
                       make_store(store->name, widen_.spread(store->value), widen_(store->index),
                                  widen_.masked(store->predicate, lanes), store->symbol));
  }

  // A buffer that several lanes store to may be read by nothing but the `own` loads of the store
  // itself.
  void require_no_load(const std::string& buffer, int own) {
    auto it = facts_.loads.find(buffer);
    must_stay_serial_ |= it != facts_.loads.end() && it->second > own;
  }

  // Of a nest of ramps with known strides one must step over all of the other.
  static bool hits_each_element_once(const Expr& index) {
    const Ramp* ramp = index.as<Ramp>();
    if (!ramp || is_zero(ramp->stride)) return false;
    if (ramp->base.type().is_scalar()) return true;
    const Ramp* inner = ramp->base.as<Ramp>();
    if (!inner || !hits_each_element_once(ramp->base)) return false;
    auto outer_step = as_const_int(ramp->stride), inner_step = as_const_int(inner->stride);
    if (!outer_step || !inner_step) return true;
    return std::abs(*outer_step) >= std::abs(*inner_step) * inner->lanes ||
           std::abs(*inner_step) >= std::abs(*outer_step) * ramp->lanes;
  }

  Stmt store_reduction(const Stmt& s, const Store& n, const UpdateChain& reduction) {
    require_no_load(n.name, own_loads(n));
    if (must_stay_serial_) return s;
    Expr active = widen_.masked(varies(n.predicate) ? n.predicate : Expr(), n.value.type().lanes());
    Expr result = reduction.own;
    for (const UpdateChain::Term& term : reduction.terms) {
      Expr reduced = reduce(reduction.kind, term.value, active);
      result = binary(term.is_negated ? Kind::Sub : reduction.kind, result, reduced);
    }
    Expr predicate = varies(n.predicate) ? Expr() : n.predicate;
    return make_store(n.name, result, n.index, predicate, n.symbol);
  }

  // The terms of all iterations, combined lane by lane of the statement.
  Expr reduce(Kind kind, const Expr& term, const Expr& active) {
    int lanes = term.type().lanes();
    Expr wide = widen_.spread(term);
    if (active.defined()) wide = make_select(active, wide, identity_of(kind, wide.type()));
    if (lanes > 1) {  // iteration-major to lane-major: the groups that are reduced lie side by side
      std::vector<int> indices;
      for (int lane = 0; lane < lanes; ++lane) {
        for (int iteration = 0; iteration < iterations_; ++iteration)
          indices.push_back(iteration * lanes + lane);
      }
      wide = make_shuffle({wide}, indices);
    }
    return make_vector_reduce(kind, wide, lanes);
  }

  // ---- lane by lane ----

  // A loop over the lanes when everything the statement needs of its surroundings can be computed
  // again, else one copy of the statement per lane, which takes its operands out of the vectors.
  Stmt lane_by_lane(const Stmt& s) { return can_recompute() ? lane_loop(s) : lane_copies(s); }

  bool can_recompute() const {
    auto is_pure = [](const Expr& e) {
      return !has_effects(e) && !reads_memory(e, MemoryReads::Loads);
    };
    return std::all_of(lets_.begin(), lets_.end(),
                       [&](const auto& let) { return is_pure(let.second); }) &&
           std::all_of(conditions_.begin(), conditions_.end(), is_pure);
  }

  Stmt lane_loop(const Stmt& s) {
    Stmt body = make_lets(lets_, make_if(conjunction(conditions_), s));
    std::string lane = fresh_(loop_.name);
    Expr number = binary(Kind::Sub, variable(lane), loop_.min);
    body = with_own_elements(body, number);
    body = copy_statement(body, fresh_, {{loop_.name, variable(lane)}});
    return make_for(lane, loop_.min, make_const(loop_.min.type(), iterations_), ForType::Serial,
                    body);
  }

  Stmt lane_copies(const Stmt& s) {
    std::vector<Stmt> copies;
    for (int i = 0; i < iterations_; ++i) {
      Substitution values;
      for (const auto& [name, wide] : widen_.bound()) {
        values[name] = extract_iteration(wide, i, narrow_lanes(wide));
      }
      Stmt copy = copy_statement(with_own_elements(s, Expr(i)), fresh_, values);
      const Expr& mask = widen_.mask();
      copies.push_back(mask.defined() ? make_if(extract_iteration(mask, i, 1), copy) : copy);
    }
    return make_block(std::move(copies));
  }

  int narrow_lanes(const Expr& wide) const { return wide.type().lanes() / iterations_; }

  // Accesses of allocations that exist once per lane, as seen by one lane.
  Stmt with_own_elements(const Stmt& s, const Expr& lane) const {
    if (widen_.wide_allocations().empty()) return s;
    const auto own = [&](const Expr& index) {
      Expr scaled = binary(Kind::Mul, index, make_const(index.type(), iterations_));
      return binary(Kind::Add, scaled,
                    make_broadcast(cast_to(index.type().element_of(), lane), index.type().lanes()));
    };
    const Stmt loads = rewrite(s, [&](const Expr& e, const auto& recurse) {
      const Expr copy = map_children(e, recurse);
      const Load* n = copy.as<Load>();
      if (!n || !widen_.is_wide_allocation(n->name)) return copy;
      return make_load(n->type, n->name, own(n->index), n->predicate, n->symbol);
    });
    return rewrite_statements(loads, [&](const Stmt& part, auto& all) {
      const Store* n = part.as<Store>();
      if (!n || !widen_.is_wide_allocation(n->name)) return all.children(part);
      return make_store(n->name, n->value, own(n->index), n->predicate, n->symbol);
    });
  }

  const For& loop_;
  const int iterations_;
  FreshNames& fresh_;
  Widener widen_;
  BodyFacts facts_;
  Lets lets_;  // around the current statement, those that vary, as one iteration has them
  std::vector<Expr> conditions_;  // of one iteration, that make up the mask
  bool must_stay_serial_ = false;
};

// ---- all loops ----

int widest_vector(const Stmt& s) {
  int lanes = 1;
  walk(
      s, [&](const Expr& e) { return lanes = std::max(lanes, e.type().lanes()), true; },
      [](const Stmt&) { return true; });
  return lanes;
}

Stmt vectorized(const For& loop, FreshNames& fresh) {
  auto extent = as_const_int(simplify(loop.extent));
  std::string what = "vectorize " + describe_loop(loop.name);
  if (!extent) {
    user_error(what, "the extent of a vectorized loop must be a constant",
               text("its extent is ", loop.extent),
               "Vectorize the inner variable of a split by a constant, or promise the extent "
               "with bound()");
  }
  if (*extent <= 0) return {};
  if (*extent == 1) return substitute(loop.body, loop.name, loop.min);
  int64_t lanes = *extent * widest_vector(loop.body);
  if (lanes > max_lanes) {
    user_error(what, text("vectors have at most ", max_lanes, " lanes"),
               text("this loop needs ", lanes), "Split the variable, and vectorize the inner part");
  }
  return LoopVectorizer(loop, static_cast<int>(*extent), fresh).run();
}

}  // namespace

Stmt vectorize_loops(const Stmt& s) {
  if (!has_loops(s, ForType::Vectorized)) return s;
  FreshNames fresh(s);
  const Stmt result = rewrite_statements(s, [&](const Stmt& node, auto& all) {
    const Stmt inner = all.children(node);
    const For* loop = inner.as<For>();
    return loop && loop->runs == ForType::Vectorized ? vectorized(*loop, fresh) : inner;
  });
  return result.defined() ? result : make_evaluate(Expr(0));
}

}  // namespace retrograde::ir
