#include "lower/loops/equal_nests.h"

#include <map>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/node_count.h"
#include "ir/shifted_renaming.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "lower/runtime_call.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

constexpr const char* stand_in = "equal_nest";
constexpr int least_nodes = 50;  // of a nest that is worth sharing

// The arms of conditions around a place, outermost first.
using Conditions = std::vector<std::pair<const StmtNode*, bool>>;

struct Nest {
  std::string name;  // of its produce statement
  Stmt body;
  Conditions conditions;
  std::unordered_set<std::string> bound;  // names that it binds
};

// Kernels have names of their own, and a fork is no single nest.
bool is_sharable(const Stmt& body) {
  if (has_at_most_nodes(body, least_nodes)) return false;
  bool is_plain = true;
  walk(
      body, [&](const For& loop) { is_plain = is_plain && !is_gpu(loop.runs); },
      [&](const Fork&) { is_plain = false; }, [&](const Atomic&) { is_plain = false; });
  return is_plain;
}

std::unordered_set<std::string> bound_in(const Stmt& s) {
  std::unordered_set<std::string> names;
  walk(
      s, [&](const Let& n) { names.insert(n.name); },
      [&](const LetStmt& n) { names.insert(n.name); }, [&](const For& n) { names.insert(n.name); },
      [&](const Allocate& n) { names.insert(n.name); },
      [&](const ProducerConsumer& n) { names.insert(n.name); });
  return names;
}

// Walks the statements at root in their order.
class Sharing : public StatementRewriter {
 protected:
  Stmt rewrite(const Stmt& s) override {
    if (s.as<For>() || s.as<Fork>()) return s;  // no root inside
    if (const auto* n = s.as<Allocate>()) {
      allocations_[n->name] = n;
      return children(s);
    }
    if (const auto* n = s.as<IfThenElse>()) return in_arms(*n);
    const auto* n = s.as<ProducerConsumer>();
    if (!n || !n->produces || !is_sharable(n->body)) return children(s);
    Nest nest{n->name, n->body, conditions_, bound_in(n->body)};
    for (const Nest& earlier : nests_) {
      if (const std::optional<Stmt> call = stand_in_for(nest, earlier))
        return make_producer_consumer(n->name, true, *call);
    }
    nests_.push_back(std::move(nest));
    return s;
  }

 private:
  Stmt in_arms(const IfThenElse& n) {
    const auto arm = [&](const Stmt& part, bool side) {
      if (!part.defined()) return part;
      conditions_.emplace_back(&n, side);
      const Stmt result = (*this)(part);
      conditions_.pop_back();
      return result;
    };
    const Stmt when_true = arm(n.when_true, true), when_false = arm(n.when_false, false);
    return make_if(n.condition, when_true, when_false);
  }

  // The memory that the later nest uses in place of the earlier one's, as arguments of the call.
  std::optional<Stmt> stand_in_for(const Nest& later, const Nest& earlier) const {
    if (earlier.conditions != later.conditions) return std::nullopt;
    const auto equal = shifted_renaming(earlier.body, later.body);
    if (!equal) return std::nullopt;
    for (const auto& [name, shift] : equal->shifts) {
      if (earlier.bound.contains(name) || allocations_.contains(name)) return std::nullopt;
    }
    const std::map<std::string, std::string> sorted(equal->names.begin(), equal->names.end());
    std::vector<Expr> args{Expr(stand_in), Expr(earlier.name)};
    std::unordered_set<std::string> used;  // scalars, which must stay bound
    for (const auto& [from, to] : sorted) {
      if (earlier.bound.contains(from)) continue;
      const auto a = allocations_.find(from), b = allocations_.find(to);
      if (from != to && (a == allocations_.end() || b == allocations_.end() ||
                         !are_alike(*a->second, *b->second)))
        return std::nullopt;
      const Shift* shift = find_or_null(equal->shifts, from);
      if (from == to && a == allocations_.end() && !shift) continue;
      args.push_back(Expr(from));
      args.push_back(make_load(shift ? shift->type : b->second->type, to, 0));
      if (shift) args.push_back(make_const(Int(64), shift->elements));
    }
    walk(later.body, [&](const Variable& v) {
      if (!later.bound.contains(v.name) && used.insert(v.name).second) args.push_back(Expr(&v));
    });
    return make_evaluate(call_op(Op::runtime_call, Int(32), std::move(args)));
  }
  static bool are_alike(const Allocate& a, const Allocate& b) {
    return a.type == b.type && a.memory == b.memory && equal(a.elements, b.elements);
  }

  std::vector<Nest> nests_;  // the first of each kind
  std::unordered_map<std::string, const Allocate*> allocations_;
  Conditions conditions_;
};

const Call* as_stand_in(const Stmt& s) {
  const auto* evaluate = s.as<Evaluate>();
  const Call* call = evaluate ? as_op(evaluate->value, Op::runtime_call) : nullptr;
  const auto* name = call ? call->args[0].as<StringImm>() : nullptr;
  return name && name->value == stand_in ? call : nullptr;
}

// Replaces the names of memory, and adds constants to indices.
class Renamer : public Rewriter {
 public:
  using Shifts = std::unordered_map<std::string, int64_t>;
  Renamer(const Renaming& names, const Shifts& shifts) : names_(names), shifts_(shifts) {}

 protected:
  Expr rewrite(const Expr& e) override {
    const Expr result = map_children(
        e, [this](const Expr& child) { return (*this)(child); },
        [this](Kind kind, const std::string& name) { return name_of(kind, name); });
    const auto *before = e.as<Load>(), *n = result.as<Load>();
    const int64_t shift = before ? value_or(shifts_, before->name, 0) : 0;
    return shift == 0 ? result
                      : make_load(n->type, n->name, shifted_index(n->index, shift), n->predicate,
                                  n->symbol);
  }
  Stmt rewrite(const Stmt& s) override {
    const Stmt result = map_children(
        s, [this](const Expr& child) { return (*this)(child); },
        [this](const Stmt& child) { return (*this)(child); },
        [this](Kind kind, const std::string& name) { return name_of(kind, name); });
    const auto *before = s.as<Store>(), *n = result.as<Store>();
    const int64_t shift = before ? value_or(shifts_, before->name, 0) : 0;
    return shift == 0 ? result
                      : make_store(n->name, n->value, shifted_index(n->index, shift), n->predicate,
                                   n->symbol);
  }

 private:
  std::string name_of(Kind kind, const std::string& name) const {
    return kind == Kind::ProducerConsumer ? name : value_or(names_, name, name);
  }
  const Renaming& names_;
  const Shifts& shifts_;
};

class Expansion : public StatementRewriter {
 public:
  explicit Expansion(const Stmt& s) : fresh_(s) {
    walk(s, [&](const ProducerConsumer& n) {
      if (n.produces) nests_.emplace(n.name, n.body);
    });
  }

 protected:
  Stmt rewrite(const Stmt& s) override {
    const Call* call = as_stand_in(s);
    if (!call) return s.as<For>() ? s : children(s);
    const auto found = nests_.find(call->args[1].as<StringImm>()->value);
    internal_assert(found != nests_.end());
    Renaming memory;
    Renamer::Shifts shifts;
    for (size_t i = 2; i + 1 < call->args.size() && call->args[i].as<StringImm>();) {
      const std::string& name = call->args[i].as<StringImm>()->value;
      memory[name] = call->args[i + 1].as<Load>()->name;
      i += 2;
      const auto* shift = i < call->args.size() ? call->args[i].as<IntImm>() : nullptr;
      if (shift) shifts[name] = shift->value;
      i += shift ? 1 : 0;
    }
    return Renamer(memory, shifts)(copy_statement(found->second, fresh_));
  }

 private:
  FreshNames fresh_;
  std::unordered_map<std::string, Stmt> nests_;
};

}  // namespace

Stmt share_equal_nests(const Stmt& s) { return Sharing()(s); }

Stmt expand_equal_nests(const Stmt& s) {
  bool has_stand_ins = false;
  walk(s, [&](const Evaluate& n) { has_stand_ins |= as_stand_in(Stmt(&n)) != nullptr; });
  return has_stand_ins ? Expansion(s)(s) : s;
}

}  // namespace retrograde::lower
