// share_lets -- statements that run one after another bind equal indices once.
// In:  Vector; names unique.
// Out: Vector; the same loads and stores in the same order; names unique.
//
//   let t = a + x * 64                      let t = a + x * 64
//   out[t] = in[s * (t - m) + n]       =>   out[t] = in[s * (t - m) + n]
//   let t.$1 = a + x * 64                   out[t + k] = in[s * (t - m) + n]
//   out[t.$1 + k] = in[n + s * (t.$1 - m)]
//
// Unrolled copies have names of their own, and simplification orders the terms of a sum by names. With one name, equal
// sums of the copies are written alike, so that code generation computes and loads them once.
//
// Method: lets of integers that neither load nor call anything are compared in the order in which they are bound, by
//         value, inside of lets and blocks. The first of equal ones moves to the front, with those that it mentions.
// Not done: equal lets in different loops or conditions.
// Source: local value numbering, folklore. Tests: test/golden/lower/share_lets/.
#include <unordered_map>
#include <unordered_set>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"
#include "lower/statement_passes.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

bool may_move(const Expr& value) {
  return value.type().is_int_or_uint() && value.type().is_scalar() &&
         !any_node(
             value, [](const Load&) { return true; }, [](const Call&) { return true; });
}

bool is_straight(const Stmt& s) { return s.kind() == Kind::LetStmt || s.kind() == Kind::Block; }

// Lets and blocks that no loop or condition separates.
class StraightCode {
 public:
  explicit StraightCode(const Stmt& s) {
    find(s);
    for (auto let = in_order_.rbegin(); let != in_order_.rend(); ++let) {
      if (!shared_.contains(let->first)) continue;
      walk(let->second, [&](const Variable& name) {
        if (movable_.contains(name.name)) shared_.insert(name.name);
      });
    }
    std::erase_if(in_order_, [&](const auto& let) { return !shared_.contains(let.first); });
  }
  const Lets& shared() const { return in_order_; }
  bool is_dropped(const std::string& name) const {
    return shared_.contains(name) || others_.contains(name);
  }
  template <class Tree>
  Tree renamed(const Tree& tree) const {
    return others_.empty() ? tree : substitute(tree, others_);
  }

 private:
  Lets in_order_;  // that may move, the first of equal ones; in the end, those that do
  std::unordered_map<Expr, std::string, StructuralHash, StructuralEqual> known_;
  std::unordered_set<std::string> movable_, shared_, staying_;
  Substitution others_;  // names of equal lets, by the first one

  void find(const Stmt& s) {
    if (const auto* block = s.as<Block>()) {
      for (const Stmt& child : block->stmts) find(child);
    } else if (const auto* let = s.as<LetStmt>()) {
      note(*let);
      find(let->body);
    }
  }
  void note(const LetStmt& let) {
    const Expr value = renamed(let.value);
    if (!may_move(value) || uses_any_variable(value, staying_)) {
      staying_.insert(let.name);
      return;
    }
    const auto [known, is_new] = known_.try_emplace(value, let.name);
    if (is_new) {
      in_order_.emplace_back(let.name, value);
      movable_.insert(let.name);
    } else {
      shared_.insert(known->second);
      others_[let.name] = variable(known->second, value.type());
    }
  }
};

class LetSharer : public StatementRewriter {
 protected:
  Stmt rewrite(const Stmt& s) override {
    if (!is_straight(s)) return children(s);
    const StraightCode code(s);
    return make_lets(code.shared(), rebuilt(s, code));
  }

 private:
  Stmt rebuilt(const Stmt& s, const StraightCode& code) {
    if (const auto* block = s.as<Block>()) {
      bool is_changed = false;
      std::vector<Stmt> stmts;
      for (const Stmt& child : block->stmts) {
        stmts.push_back(rebuilt(child, code));
        is_changed |= !stmts.back().same_as(child);
      }
      return is_changed ? make_block(std::move(stmts)) : s;
    }
    const auto* let = s.as<LetStmt>();
    if (!let) return code.renamed((*this)(s));
    const Stmt body = rebuilt(let->body, code);
    if (code.is_dropped(let->name)) return body;
    const Expr value = code.renamed(let->value);
    return value.same_as(let->value) && body.same_as(let->body) ? s
                                                                : make_let(let->name, value, body);
  }
};

}  // namespace

Stmt share_lets(const Stmt& s) { return s.defined() ? LetSharer()(s) : s; }

}  // namespace retrograde::lower
