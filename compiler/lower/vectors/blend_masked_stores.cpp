// blend_masked_stores -- replace masked accesses of local allocations by accesses of whole vectors.
// In:  Vector; names unique.
// Out: Vector; names unique. A store writes the old value back to masked-off elements; elements that a load reads
//      beyond its mask are not used.
//
//   allocate t[8] {                             allocate t[8] {
//     t[ramp(4, 1, 4) if m] =             =>      t[ramp(4, 1, 4)] =
//         t[ramp(4, 1, 4) if m] + x                   select(m, t[ramp(4, 1, 4)] + x,
//                                                            t[ramp(4, 1, 4)])
//   }                                           }
//
// Accumulators then stay in registers at the border of a domain, too. LLVM treats masked stores as opaque calls, and
// a load right after a masked store waits for the cache. Masked loads of bytes have no instruction on many
// processors and run lane by lane.
//
// Method: a dense vector with a constant index in storage of constant size is accessed whole. Elsewhere the mask must
//         be a prefix: it holds in the first lanes or nowhere, as the mask of a tail does. If it holds anywhere, the
//         first element lies inside the storage, and the storage is padded for the other lanes. Stores run under a
//         check of the mask's first lane, and neighbouring stores share one check. A load whose mask holds
//         nowhere reads from the start of the storage. No other thread may see the stores: no parallel loop or fork
//         lies between the allocation and the store.
// Not done: masks that hold only in later lanes; strided accesses; stores to storage of run-time size that do not
//         read the element that they replace, which would gain nothing.
// Source: folklore. Tests: test/golden/lower/blend_masked_stores/, loop_passes_test.
#include "lower/statement_passes.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "ir/atomic_update.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"
#include "lower/vectors/widen_expr.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

// A dense index: consecutive elements, possibly written as a ramp of ramps.
struct Dense {
  Expr first;
  int lanes;
};
std::optional<Dense> as_dense(const Expr& index) {
  const auto* ramp = index.as<Ramp>();
  if (!ramp) return std::nullopt;
  if (ramp->base.type().is_scalar())
    return is_const_int(ramp->stride, 1) ? std::optional(Dense{ramp->base, ramp->lanes})
                                         : std::nullopt;
  const auto inner = as_dense(ramp->base);
  if (!inner || as_const_int(ramp->stride) != inner->lanes) return std::nullopt;
  return Dense{inner->first, inner->lanes * ramp->lanes};
}

Expr scalar_of(const Expr& e) {
  const auto* splat = e.as<Broadcast>();
  return splat && splat->value.type().is_scalar() ? splat->value : Expr();
}

// For a mask that holds in the first lanes or nowhere: the condition that it holds in the first lane.
Expr first_of_prefix(const Expr& mask) {
  if (const Expr all = scalar_of(mask); all.defined()) return all;
  const auto* lanes = mask.as<Shuffle>();
  if (lanes && lanes->vectors.size() == 1 && lanes->indices[0] == 0 &&
      std::is_sorted(lanes->indices.begin(), lanes->indices.end()))
    return first_of_prefix(lanes->vectors[0]);
  const auto* op = mask.as<Binary>();
  if (!op) return {};
  if (mask.kind() == Kind::And) {
    const Expr a = first_of_prefix(op->a), b = first_of_prefix(op->b);
    return a.defined() && b.defined() ? binary(Kind::And, a, b) : Expr();
  }
  const bool is_below = mask.kind() == Kind::LT || mask.kind() == Kind::LE;
  const auto lane = is_below ? as_dense(op->a) : std::nullopt;
  const Expr end = is_below ? scalar_of(op->b) : Expr();
  return lane && end.defined() ? binary(mask.kind(), lane->first, end) : Expr();
}

// The same, simplified; undefined also if it reads memory or calls something, so that its value could change.
Expr check_of(const Expr& mask) {
  const Expr first = first_of_prefix(mask);
  return first.defined() && !reads_memory(first, MemoryReads::Calls) ? simplify(first) : Expr();
}

struct Storage {
  std::optional<int64_t> elements;
  int task;  // number of parallel loops and forks around the allocation
  int padding = 0;

  bool can_prove_inside(const Dense& places) const {
    const auto first = as_const_int(places.first);
    return first && elements && *first >= 0 && *first + places.lanes <= *elements;
  }
  void pad_for(const Dense& places) { padding = std::max(padding, places.lanes); }
};

class BlendMaskedStores : public Rewriter {
 protected:
  Expr rewrite(const Expr& e) override {
    const Expr result = children(e);
    const auto* load = result.as<Load>();
    return load && load->predicate.defined() ? visit_load(result, *load) : result;
  }

  Stmt rewrite(const Stmt& s) override {
    return match(
        s, [&](const Allocate& n) { return visit_allocate(s, n); },
        [&](const Store& n) { return n.predicate.defined() ? visit_store(s, n) : children(s); },
        [&](const For& n) { return runs_at_once(n.runs) ? in_task(s) : children(s); },
        [&](const Fork&) { return in_task(s); }, [&](const Atomic&) { return s; },
        [&](const IfThenElse& n) { return visit_if(n); },
        [&](const Block& n) { return visit_block(s, n); },
        [&](const LetStmt&) { return check_before_let(children(s)); },
        [&](const StmtNode&) { return children(s); });
  }

 private:
  // Rewrites a statement that may run concurrently with the code around it.
  Stmt in_task(const Stmt& s) {
    ++task_;
    Stmt result = children(s);
    --task_;
    return result;
  }

  Stmt visit_allocate(const Stmt& s, const Allocate& n) {
    storage_[n.name] = {as_const_int(n.elements), task_};
    const Stmt body = (*this)(n.body);
    const int padding = storage_[n.name].padding;
    storage_.erase(n.name);
    if (padding == 0 && body.same_as(n.body)) return s;
    const Expr elements =
        binary(Kind::Add, n.elements, make_const(n.elements.type(), int64_t{padding}));
    return make_allocate(n.name, n.type, n.memory, elements, body);
  }

  Stmt visit_if(const IfThenElse& n) {
    const Stmt when_true = knowing(n.condition, [&] { return (*this)(n.when_true); });
    const Expr condition = (*this)(n.condition);
    return with_parts(n, condition, when_true, (*this)(n.when_false));
  }

  Stmt knowing(const Expr& condition, const std::function<Stmt()>& f) {
    const size_t before = known_.size();
    note(condition);
    forget();
    Stmt result = f();
    known_.resize(before);
    forget();
    return result;
  }

  void note(const Expr& condition) {
    const auto* both = condition.kind() == Kind::And ? condition.as<Binary>() : nullptr;
    if (both) note(both->a);
    if (both) note(both->b);
    if (!both) known_.push_back(condition);
  }

  bool is_known(const Expr& condition) const {
    const auto* both = condition.kind() == Kind::And ? condition.as<Binary>() : nullptr;
    if (both) return is_known(both->a) && is_known(both->b);
    return is_const_true(condition) ||
           std::ranges::any_of(known_, [&](const Expr& other) { return equal(condition, other); });
  }

  Expr visit_load(const Expr& e, const Load& n) {
    const auto storage = storage_.find(n.name);
    const auto places = as_dense(n.index);
    if (storage == storage_.end() || !places) return e;
    if (storage->second.can_prove_inside(*places))
      return make_load(n.type, n.name, n.index, {}, n.symbol);
    const Expr check = check_of(n.predicate);
    if (!check.defined()) return e;
    storage->second.pad_for(*places);
    const Expr first = is_known(check)
                           ? places->first
                           : make_select(check, places->first, make_zero(places->first.type()));
    return make_load(n.type, n.name, moved(n.index, first), {}, n.symbol);
  }

  static Expr moved(const Expr& index, const Expr& first) {
    const auto* ramp = index.as<Ramp>();
    return ramp ? make_ramp(moved(ramp->base, first), ramp->stride, ramp->lanes) : first;
  }

  Stmt visit_store(const Stmt& s, const Store& n) {
    const auto storage = storage_.find(n.name);
    const auto places = as_dense(n.index);
    if (storage == storage_.end() || storage->second.task != task_ || !places) return children(s);
    if (storage->second.can_prove_inside(*places)) return blended(n);
    const Expr check = check_of(n.predicate);
    if (!check.defined() || !loads_from(n.value, n.name)) return children(s);
    storage->second.pad_for(*places);
    if (is_known(check)) return blended(n);
    return checked(check, knowing(check, [&] { return blended(n); }));
  }

  Stmt blended(const Store& n) {
    const Expr old = make_load(n.value.type(), n.name, n.index, {}, n.symbol);
    return make_store(n.name, make_select((*this)(n.predicate), (*this)(n.value), old), n.index, {},
                      n.symbol);
  }

  // ---- merging the checks of several stores ----

  Stmt checked(const Expr& condition, const Stmt& body) {
    Stmt result = make_if(condition, body);
    if (result.as<IfThenElse>()) checks_.insert(result);
    return result;
  }

  const IfThenElse* as_check(const Stmt& s) const {
    return checks_.count(s) ? s.as<IfThenElse>() : nullptr;
  }

  Stmt check_before_let(const Stmt& s) {
    const auto* let = s.as<LetStmt>();
    const IfThenElse* check = let ? as_check(let->body) : nullptr;
    if (!check || uses_variable(check->condition, let->name) || has_effects(let->value)) return s;
    return checked(check->condition, make_let(let->name, let->value, check->when_true));
  }

  Stmt visit_block(const Stmt& s, const Block& n) {
    std::vector<Stmt> parts;
    bool changed = false;
    for (const Stmt& part : n.stmts) {
      parts.push_back((*this)(part));
      changed |= !parts.back().same_as(part);
      if (parts.size() < 2) continue;
      const IfThenElse *before = as_check(parts[parts.size() - 2]), *last = as_check(parts.back());
      if (!before || !last || !equal(before->condition, last->condition)) continue;
      const Stmt both =
          checked(before->condition, make_block({before->when_true, last->when_true}));
      parts.pop_back();
      parts.back() = both;
    }
    return changed ? make_block(std::move(parts)) : s;
  }

  struct SameNode {
    bool operator()(const Stmt& a, const Stmt& b) const { return a.same_as(b); }
  };
  struct HashNode {
    size_t operator()(const Stmt& s) const { return std::hash<const StmtNode*>()(s.get()); }
  };

  std::unordered_map<std::string, Storage> storage_;
  int task_ = 0;
  std::vector<Expr> known_;                              // conditions around the current statement
  std::unordered_set<Stmt, HashNode, SameNode> checks_;  // checks that this pass generated
};

}  // namespace

Stmt blend_masked_stores(const Stmt& s) { return s.defined() ? BlendMaskedStores()(s) : s; }

}  // namespace retrograde::lower
