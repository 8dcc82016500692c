// join_indices -- simplify indices in which a quotient and its remainder recombine.
// In:  FlatStorage, before vectorization; names unique.
// Out: FlatStorage; the same loads and stores.
//
//   let x = f / 3                          let x = f / 3
//   let c = f % 3                    =>    let c = f % 3
//   out[x*3 + c] = in[x*3 + c] * k[c]      out[f] = in[f] * k[c]
//
// Loops over fused dimensions that are adjacent in memory, such as the channels and columns of an interleaved image,
// then have dense accesses.
//
// Method: if an index mentions names of a quotient and of a remainder, both are substituted and the index is
//         simplified; the result is kept if it has fewer divisions.
// Not done: names used in the values of other lets.
// Source: folklore. Tests: test/golden/lower/join_indices/, loop_passes_test.
#include "lower/statement_passes.h"

#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int largest_value = 32;  // nodes of a substituted value

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

  Substitution values_;  // of names whose value contains a division
};

}  // namespace

Stmt join_indices(const Stmt& s) { return s.defined() ? IndexJoiner()(s) : s; }

}  // namespace retrograde::lower
