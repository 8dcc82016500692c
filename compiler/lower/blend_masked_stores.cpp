// blend_masked_stores -- stores under a mask into storage of one's own write whole vectors.
// In:  Vector; names unique.
// Out: Vector; names unique. What such a store leaves alone it writes back.
//
//   allocate t[8] {                             allocate t[8] {
//     t[ramp(4, 1, 4) if m] =             =>      t[ramp(4, 1, 4)] =
//         t[ramp(4, 1, 4) if m] + x                   select(m, t[ramp(4, 1, 4)] + x,
//                                                            t[ramp(4, 1, 4)])
//   }                                           }
//
// So an accumulator stays in a register at the border of its domain, too: LLVM takes masked stores
// for calls, and a processor that loads what one has just stored waits for the cache.
//
// Method: storage is one's own between its allocation and the first loop or branch that other
//         threads run. A vector with constant places in storage of constant size is written as it
//         is. Elsewhere the mask must hold in its first lanes if anywhere (a tail's does): then its
//         first lane, which is checked, lies inside the storage, which gets room for the others.
//         Neighbours under one check share it.
// Not done: masks that begin later; strided stores; stores with places of run-time size that do not
//         read what they replace, which gain nothing.
// Source: folklore. Tests: test/golden/lower/blend_masked_stores/, loop_passes_test.
#include "lower/blend_masked_stores.h"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "ir/atomic_update.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"
#include "lower/widen_expr.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

const Ramp* as_dense(const Expr& index) {
  const auto* ramp = index.as<Ramp>();
  const bool is_dense = ramp && ramp->base.type().is_scalar() && is_const_int(ramp->stride, 1);
  return is_dense ? ramp : nullptr;
}

Expr scalar_of(const Expr& e) {
  const auto* splat = e.as<Broadcast>();
  return splat && splat->value.type().is_scalar() ? splat->value : Expr();
}

// Of a mask that holds in the first lanes or in none: whether it holds in the first.
Expr first_of_prefix(const Expr& mask) {
  if (const Expr all = scalar_of(mask); all.defined()) return all;
  const auto* op = mask.as<Binary>();
  if (!op) return {};
  if (mask.kind() == Kind::And) {
    const Expr a = first_of_prefix(op->a), b = first_of_prefix(op->b);
    return a.defined() && b.defined() ? binary(Kind::And, a, b) : Expr();
  }
  const bool is_below = mask.kind() == Kind::LT || mask.kind() == Kind::LE;
  const Ramp* ramp = is_below ? as_dense(op->a) : nullptr;
  const Expr end = is_below ? scalar_of(op->b) : Expr();
  return ramp && end.defined() ? binary(mask.kind(), ramp->base, end) : Expr();
}

struct OwnStorage {
  std::optional<int64_t> elements;
  int padding = 0;
};

// The value of a store as it is where the mask does not matter.
Expr unmasked(const Store& store) {
  return rewrite(store.value, [&](const Expr& e, const std::function<Expr(const Expr&)>& recurse) {
    const auto* load = e.as<Load>();
    const bool is_own = load && load->name == store.name && load->predicate.defined() &&
                        equal(load->index, store.index) && equal(load->predicate, store.predicate);
    return is_own ? make_load(load->type, load->name, load->index, {}, load->symbol)
                  : map_children(e, recurse);
  });
}

Stmt blended(const Store& store) {
  const Expr old = make_load(store.value.type(), store.name, store.index, {}, store.symbol);
  return make_store(store.name, make_select(store.predicate, unmasked(store), old), store.index, {},
                    store.symbol);
}

class BlendMaskedStores : public Rewriter {
 protected:
  Expr rewrite(const Expr& e) override { return e; }

  Stmt rewrite(const Stmt& s) override {
    return match(
        s, [&](const Allocate& n) { return visit_allocate(s, n); },
        [&](const Store& n) { return n.predicate.defined() ? visit_store(s, n) : s; },
        [&](const For& n) { return n.for_type == ForType::Parallel ? in_task(s) : children(s); },
        [&](const Fork&) { return in_task(s); }, [&](const Atomic&) { return s; },
        [&](const Block& n) { return visit_block(s, n); },
        [&](const LetStmt&) { return check_before_let(children(s)); },
        [&](const StmtNode&) { return children(s); });
  }

 private:
  // Other threads may run it at the same time as what surrounds it.
  Stmt in_task(const Stmt& s) {
    std::unordered_map<std::string, OwnStorage> around;
    std::swap(around, own_);
    Stmt result = children(s);
    std::swap(around, own_);
    return result;
  }

  Stmt visit_allocate(const Stmt& s, const Allocate& n) {
    own_[n.name] = {as_const_int(n.elements), 0};
    const Stmt body = (*this)(n.body);
    const int padding = own_[n.name].padding;
    own_.erase(n.name);
    if (padding == 0 && body.same_as(n.body)) return s;
    const Expr elements =
        binary(Kind::Add, n.elements, make_const(n.elements.type(), int64_t{padding}));
    return make_allocate(n.name, n.type, n.memory, elements, body);
  }

  Stmt visit_store(const Stmt& s, const Store& n) {
    const auto own = own_.find(n.name);
    const Ramp* places = as_dense(n.index);
    if (own == own_.end() || !places) return s;
    const auto first = as_const_int(places->base);
    const auto& elements = own->second.elements;
    if (first && elements && *first >= 0 && *first + places->lanes <= *elements) return blended(n);
    const Expr runs = first_of_prefix(n.predicate);
    if (!runs.defined() || !loads_from(n.value, n.name) || reads_memory(runs, MemoryReads::Calls))
      return s;
    own->second.padding = std::max(own->second.padding, places->lanes - 1);
    return checked(simplify(runs), blended(n));
  }

  // ---- checks of several stores become one ----

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
    return checked(check->condition, make_let(let->name, let->value, check->then_case));
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
          checked(before->condition, make_block({before->then_case, last->then_case}));
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

  std::unordered_map<std::string, OwnStorage> own_;
  std::unordered_set<Stmt, HashNode, SameNode> checks_;  // those that this pass has made
};

}  // namespace

Stmt blend_masked_stores(const Stmt& s) { return s.defined() ? BlendMaskedStores()(s) : s; }

}  // namespace retrograde::ir
