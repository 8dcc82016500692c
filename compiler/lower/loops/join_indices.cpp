// join_indices -- a quotient and its remainder that make up an index together are one again.
// In:  FlatStorage, before vectorization; names unique.
// Out: FlatStorage; the same loads and stores.
//
//   let x = f / 3                          let x = f / 3
//   let c = f % 3                    =>    let c = f % 3
//   out[x*3 + c] = in[x*3 + c] * k[c]      out[f] = in[f] * k[c]
//
// So a loop over fused dimensions that lie one inside the other in memory, as the channels and
// columns of an interleaved image do, has dense accesses.
//
// Method: an index that mentions a name for a quotient and one for a remainder is simplified with
//         both put in, and kept where fewer divisions are left in it.
// Not done: names inside of other names than these.
// Source: folklore. Tests: test/golden/lower/join_indices/, loop_passes_test.
#include "lower/statement_passes.h"

#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int largest_value = 32;  // in nodes, of what is put in

struct Divisions {
  int nodes = 0, quotients = 0, remainders = 0;
  int count() const { return quotients + remainders; }
};

Divisions divisions_in(const Expr& e) {
  Divisions result;
  walk(e, [&](const Expr& node) {
    ++result.nodes;
    result.quotients += node.kind() == Kind::Div;
    result.remainders += node.kind() == Kind::Mod;
    return true;
  });
  return result;
}

class IndexJoiner : public Rewriter {
 protected:
  Expr rewrite(const Expr& e) override {
    const Expr copy = children(e);
    const auto* load = copy.as<Load>();
    if (!load) return copy;
    const Expr index = joined(load->index);
    return index.same_as(load->index)
               ? copy
               : make_load(load->type, load->name, index, load->predicate, load->symbol);
  }

  Stmt rewrite(const Stmt& s) override {
    if (const auto* let = s.as<LetStmt>()) note(*let);
    const Stmt copy = children(s);
    const auto* store = copy.as<Store>();
    if (!store) return copy;
    const Expr index = joined(store->index);
    return index.same_as(store->index)
               ? copy
               : make_store(store->name, store->value, index, store->predicate, store->symbol);
  }

 private:
  void note(const LetStmt& let) {
    if (let.value.type() != Int(32)) return;
    const Divisions in_value = divisions_in(let.value);
    if (in_value.count() > 0 && in_value.nodes <= largest_value) values_[let.name] = let.value;
  }

  Expr joined(const Expr& index) const {
    if (values_.empty() || index.type() != Int(32)) return index;
    const Expr whole = substitute(index, values_);
    if (whole.same_as(index)) return index;
    const Divisions before = divisions_in(whole);
    if (before.quotients == 0 || before.remainders == 0) return index;
    const Expr simple = simplify(whole);
    return divisions_in(simple).count() + 1 < before.count() || divisions_in(simple).count() == 0
               ? simple
               : index;
  }

  Substitution values_;  // names of what divides
};

}  // namespace

Stmt join_indices(const Stmt& s) { return s.defined() ? IndexJoiner()(s) : s; }

}  // namespace retrograde::lower
