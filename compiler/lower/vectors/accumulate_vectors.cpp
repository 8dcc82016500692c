// accumulate_vectors -- combine the lanes of a vector reduction once, after its loop.
// In:  Vector; names unique.
// Out: Vector; names unique. Operands of a reduction are combined in another order, which depends on the program only.
//
//   for (r, 0, n) {                          allocate t[16] {
//     f[i] = f[i] + reduce(add, x, 1)          t[ramp(0, 1, 16)] = broadcast(-0, 16)
//   }                                  =>      for (r, 0, n) { t[...] = t[...] + x }
//                                              if (0 < n) { f[i] = f[i] + reduce(add, t[...], 1) }
//                                            }
//
// The vector t has a constant size, so it lives in registers. Sums of products of 16-bit numbers keep half the
// lanes: processors add such products in pairs (ir/narrow_product.h).
//
// Method: outermost loop first. A store is moved if its index, and every condition that decides whether it runs, is
//         loop-invariant. It must be a chain of one operator from its own element over reductions of vectors, and
//         nothing else in the loop may read or write the buffer. If the loop does not run, the element is not touched.
// Not done: stores under conditions that vary; parallel loops; chains with several operators.
// Source: folklore (reduction variable expansion). Tests: test/golden/lower/accumulate_vectors/,
// loop_passes_test, vector_reduction_test.
#include "lower/statement_passes.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "ir/atomic_update.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/memory_reads.h"
#include "ir/narrow_product.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "lower/vectors/reductions.h"

namespace retrograde::lower {

namespace {

const VectorReduce& reduce_of(const UpdateChain::Term& term) {
  return *term.value.as<VectorReduce>();
}

// Matches f[i] op reduce(x) op reduce(y) ..., where all reduced vectors have one type.
std::optional<UpdateChain> as_chain(const Store& store) {
  auto chain = find_vector_reduction(store);
  if (!chain) return std::nullopt;
  const auto* first = chain->terms[0].value.as<VectorReduce>();
  const bool is_reduced = std::ranges::all_of(chain->terms, [&](const UpdateChain::Term& term) {
    const auto* reduce = term.value.as<VectorReduce>();
    return reduce && first && reduce->op == chain->kind &&
           reduce->value.type() == first->value.type();
  });
  return is_reduced ? chain : std::nullopt;
}

// ---- reductions in a loop ----

struct Candidate {
  const Store* store;
  UpdateChain chain;
  Stmt statement;                // the store, or the Atomic around it
  std::vector<Expr> conditions;  // under which it runs at least once
};

class LoopReductions {
 public:
  explicit LoopReductions(const For& loop) {
    bound_.insert(loop.name);
    conditions_.push_back(binary(Kind::LT, make_zero(loop.extent.type()), loop.extent));
    visit(loop.body, true);
  }

  // Candidates whose buffer nothing else in the loop reads or writes.
  std::vector<Candidate> found() const {
    return filtered(candidates_, [&](const Candidate& candidate) {
      return !others_.count(candidate.store->name);
    });
  }

 private:
  // `runs_alike`: whether the statement runs either in every iteration of the loop or in none.
  void visit(const Stmt& s, bool runs_alike) {
    if (!s.defined()) return;
    match(
        s, [&](const Store& n) { visit_store(s, n, runs_alike); },
        [&](const Atomic& n) { visit_atomic(s, n, runs_alike); },
        [&](const LetStmt& n) {
          note(n.value);
          bound_.insert(n.name);
          visit(n.body, runs_alike);
        },
        [&](const For& n) {
          note(n.min);
          note(n.extent);
          bound_.insert(n.name);
          const Expr runs = binary(Kind::LT, make_zero(n.extent.type()), n.extent);
          under(runs, n.body, runs_alike && n.runs == ForType::Serial);
        },
        [&](const IfThenElse& n) {
          note(n.condition);
          under(n.condition, n.when_true, runs_alike);
          under(logical_not(n.condition), n.when_false, runs_alike);
        },
        [&](const Block& n) {
          for (const Stmt& part : n.stmts) visit(part, runs_alike);
        },
        [&](const ProducerConsumer& n) { visit(n.body, runs_alike); },
        [&](const Allocate& n) {
          note(n.elements);
          bound_.insert(n.name);
          visit(n.body, runs_alike);
        },
        [&](const StmtNode&) {
          for_each_child(
              s, [&](const Expr& e) { note(e); }, [&](const Stmt& part) { visit(part, false); });
        });
  }

  void under(const Expr& condition, const Stmt& s, bool runs_alike) {
    conditions_.push_back(condition);
    visit(s, runs_alike && is_invariant(condition));
    conditions_.pop_back();
  }

  void visit_atomic(const Stmt& s, const Atomic& n, bool runs_alike) {
    const auto* store = n.body.as<Store>();
    store ? visit_store(s, *store, runs_alike) : visit(n.body, false);
  }

  void visit_store(const Stmt& statement, const Store& n, bool runs_alike) {
    auto chain =
        runs_alike && !n.predicate.defined() && is_invariant(n.index) ? as_chain(n) : std::nullopt;
    note(n.index);
    if (!chain) {
      note(n.value);
      if (n.predicate.defined()) note(n.predicate);
      others_.insert(n.name);
      return;
    }
    for (const UpdateChain::Term& term : chain->terms) note(reduce_of(term).value);
    candidates_.push_back({&n, std::move(*chain), statement, conditions_});
  }

  bool is_invariant(const Expr& e) const {
    return !reads_memory(e, MemoryReads::Calls) && !uses_any_variable(e, bound_);
  }

  // Records the buffers that the expression reads or passes to a call.
  void note(const Expr& e) {
    walk(
        e, [&](const Load& load) { others_.insert(load.name); },
        [&](const Variable& name) {
          if (name.type.is_handle()) others_.insert(name.name.substr(0, name.name.rfind('.')));
        });
  }

  std::unordered_set<std::string> bound_, others_;
  std::vector<Expr> conditions_;
  std::vector<Candidate> candidates_;
};

// ---- the vector of partial results ----

// Matches a permutation of one vector's lanes. The order of lanes does not matter to the reduction, so the unpermuted
// vector can be accumulated.
const Shuffle* as_reordering(const Expr& e) {
  const auto* shuffle = e.as<Shuffle>();
  if (!shuffle || shuffle->vectors.size() != 1 ||
      shuffle->vectors[0].type().lanes() != e.type().lanes())
    return nullptr;
  std::vector<int> lanes = shuffle->indices;
  std::sort(lanes.begin(), lanes.end());
  for (size_t i = 0; i < lanes.size(); ++i) {
    if (lanes[i] != static_cast<int>(i)) return nullptr;
  }
  return shuffle;
}

class Accumulator {
 public:
  Accumulator(const Candidate& candidate, const std::string& name)
      : name_(name), chain_(candidate.chain), store_(*candidate.store), candidate_(candidate) {
    const Expr& value = reduce_of(chain_.terms[0]).value;
    reordering_ = as_reordering(value);
    for (const UpdateChain::Term& term : chain_.terms) {
      const auto* other = as_reordering(reduce_of(term).value);
      if (!reordering_ || !other || other->indices != reordering_->indices) reordering_ = nullptr;
      in_pairs_ &= as_narrow_product(reduce_of(term).value).has_value();
    }
    const int lanes = value.type().lanes(), group = lanes / store_.value.type().lanes();
    in_pairs_ &= chain_.kind == Kind::Add && group % 2 == 0;
    if (in_pairs_) reordering_ = nullptr;
    type_ = value.type().with_lanes(in_pairs_ ? lanes / 2 : lanes);
  }

  // Whether the reduction combines lanes at all.
  bool is_of_use() const { return type_.lanes() > store_.value.type().lanes(); }

  Stmt start() const { return store(identity_of(op(), type_)); }

  Stmt step() const {
    Expr value = load();
    for (size_t i = chain_.terms.size(); i-- > 0;) {
      const UpdateChain::Term& term = chain_.terms[i];
      value = binary(term.is_negated ? Kind::Sub : chain_.kind, value, operand(term));
    }
    return store(value);
  }

  // The statement after the loop: reduces the vector and updates the element.
  Stmt finish() const {
    const Expr all = reordering_ ? make_shuffle({load()}, reordering_->indices) : load();
    const Expr sum = make_vector_reduce(op(), all, store_.value.type().lanes());
    Stmt result = make_store(store_.name, binary(chain_.kind, chain_.own, sum), store_.index, {},
                             store_.symbol);
    if (const auto* atomic = candidate_.statement.as<Atomic>())
      result = make_atomic(atomic->name, result);
    const std::vector<Expr> conditions = filtered(
        candidate_.conditions, [&](const Expr& condition) { return !is_const_true(condition); });
    return conditions.empty() ? result : make_if(conjunction(conditions), result);
  }

  Stmt around(const Stmt& body) const {
    return make_allocate(name_, type_.element_of(), MemoryType::Stack,
                         make_const(Int(64), type_.lanes()), body);
  }

 private:
  Kind op() const { return chain_.kind; }
  Expr index() const { return make_ramp(make_zero(Int(32)), make_one(Int(32)), type_.lanes()); }
  Expr load() const { return make_load(type_, name_, index()); }
  Stmt store(const Expr& value) const { return make_store(name_, value, index()); }

  Expr operand(const UpdateChain::Term& term) const {
    const Expr& value = reduce_of(term).value;
    if (in_pairs_) return make_vector_reduce(op(), value, type_.lanes());
    return reordering_ ? value.as<Shuffle>()->vectors[0] : value;
  }

  std::string name_;
  const UpdateChain& chain_;
  const Store& store_;
  const Candidate& candidate_;
  const Shuffle* reordering_ = nullptr;
  bool in_pairs_ = true;
  Type type_;
};

}  // namespace

Stmt accumulate_vectors(const Stmt& all) {
  FreshNames fresh(all);
  return rewrite_statements(all, [&](const Stmt& s, auto& rewriter) {
    const auto* loop = s.as<For>();
    if (!loop || loop->runs != ForType::Serial) return rewriter.children(s);
    const std::vector<Candidate> candidates = LoopReductions(*loop).found();
    std::unordered_map<const StmtNode*, Stmt> steps;
    std::vector<Accumulator> accumulators;
    for (const Candidate& candidate : candidates) {
      Accumulator accumulator(candidate, fresh(candidate.store->name + ".partial"));
      if (!accumulator.is_of_use()) continue;
      steps[candidate.statement.get()] = accumulator.step();
      accumulators.push_back(std::move(accumulator));
    }
    if (accumulators.empty()) return rewriter.children(s);
    const Stmt stepping = rewrite_statements(s, [&](const Stmt& part, auto& parts) {
      const auto found = steps.find(part.get());
      return found == steps.end() ? parts.children(part) : found->second;
    });
    std::vector<Stmt> parts;
    for (const Accumulator& accumulator : accumulators) parts.push_back(accumulator.start());
    parts.push_back(rewriter.children(stepping));
    for (const Accumulator& accumulator : accumulators) parts.push_back(accumulator.finish());
    Stmt result = make_block(std::move(parts));
    for (size_t i = accumulators.size(); i-- > 0;) result = accumulators[i].around(result);
    return result;
  });
}

}  // namespace retrograde::lower
