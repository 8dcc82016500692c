#include "lower/loops/needed_stages.h"

#include <algorithm>
#include <set>
#include <unordered_set>
#include <vector>

#include "ir/build.h"
#include "lower/loops/choice_reads.h"
#include "lower/loops/enclosing_conditions.h"
#include "lower/loops/stage_needs.h"

namespace retrograde::lower {

namespace {

bool runs_on_device(const Stmt& s) {
  return any_node(s, [](const For& loop) { return is_gpu(loop.runs); });
}

// The walk over the statement.
class NeedFinder {
 public:
  explicit NeedFinder(FunctionRef<bool(const std::string&)> may_skip) : may_skip_(may_skip) {}

  StageGuards find(const Stmt& s) {
    visit(s);
    return needs_.take_guards();
  }

 private:
  void visit(const Stmt& s) {
    if (!s.defined()) return;
    match(
        s, [&](const LetStmt& n) { visit_let(n); }, [&](const For& n) { visit_loop(n); },
        [&](const IfThenElse& n) { visit_branch(n); }, [&](const Realize& n) { visit_storage(n); },
        [&](const ProducerConsumer& n) { visit_producer(s, n); },
        [&](const Provide& n) { visit_store(n); },
        [&](const StmtNode&) {
          for_each_child(
              s, [&](const Expr& e) { visit_values({e}); },
              [&](const Stmt& child) { visit(child); });
        });
  }

  void visit_let(const LetStmt& n) {
    visit_values({n.value});
    enclosing_.inside_let(n, [&] { visit(n.body); });
  }

  void visit_loop(const For& n) {
    visit_values({n.min, n.extent});
    enclosing_.inside_loop(n, [&] { visit(n.body); });
  }

  void visit_branch(const IfThenElse& n) {
    visit_values({n.condition});
    const auto where = [&](bool holds) {
      return without_calls(without_reads(usable_where(n.condition, holds)));
    };
    enclosing_.under(where(true), AtLoops::Forget, [&] { visit(n.when_true); });
    enclosing_.under(where(false), AtLoops::Forget, [&] { visit(n.when_false); });
  }

  void visit_store(const Provide& n) {
    const auto visit_operands = [&] {
      visit_values(n.args);
      visit_values({n.predicate});
      visit_values(n.values);
    };
    if (!n.predicate.defined()) return visit_operands();
    enclosing_.inside_guard(visit_operands);
  }

  void visit_storage(const Realize& n) {
    for (const Range& side : n.bounds) visit_values({side.min, side.extent});
    const bool is_candidate = may_skip_(n.name) && !enclosing_.is_in_kernel() && waiting_ == 0 &&
                              !needs_.is_open(n.name) && !forbidden_.contains(n.name);
    forbidden_.insert(n.name);  // unique names only: a name that occurs again is not a candidate
    if (!is_candidate) {
      const bool waits = !may_skip_(n.name);
      waiting_ += waits;
      visit(n.body);
      waiting_ -= waits;
      return;
    }
    needs_.begin(n.name, complete_);
    visit(n.body);
    needs_.end(n.name);
  }

  void visit_producer(const Stmt& s, const ProducerConsumer& n) {
    if (n.produces && runs_on_device(n.body)) on_device_.insert(n.name);
    if (!n.produces) return visit_consumer(n);
    if (!needs_.is_open(n.name)) return visit(n.body);
    needs_.add_producer(n.name, s);
    producing_.push_back(n.name);
    enclosing_.under(StageNeeds::is_needed(n.name), AtLoops::Forget, [&] { visit(n.body); });
    producing_.pop_back();
  }

  // A complete Func in host memory may be read by the conditions of the Funcs that follow.
  void visit_consumer(const ProducerConsumer& n) {
    const bool is_there =
        may_skip_(n.name) && !on_device_.contains(n.name) && complete_.insert(n.name).second;
    visit(n.body);
    if (is_there) complete_.erase(n.name);
  }

  void visit_values(const std::vector<Expr>& values) {
    for (const Expr& e : values) {
      if (e.defined()) visit_reads(e, enclosing_, [&](const std::string& func) { read(func); });
    }
  }

  // Reads by the Func's own updates do not make it needed.
  void read(const std::string& func) {
    if (std::ranges::find(producing_, func) == producing_.end()) needs_.add_read(func);
  }

  FunctionRef<bool(const std::string&)> may_skip_;
  EnclosingConditions enclosing_;
  StageNeeds needs_{enclosing_};
  std::vector<std::string> producing_;
  std::unordered_set<std::string> forbidden_;
  std::set<std::string> complete_, on_device_;
  int waiting_ = 0;  // around: storage that is never skipped
};

}  // namespace

StageGuards find_stage_guards(const Stmt& s, FunctionRef<bool(const std::string&)> may_skip) {
  return NeedFinder(may_skip).find(s);
}

}  // namespace retrograde::lower
