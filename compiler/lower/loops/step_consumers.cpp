#include "lower/loops/step_consumers.h"

#include <algorithm>
#include <set>

#include "analysis/linear.h"
#include "ir/build.h"
#include "lower/loops/let_values.h"
#include "lower/loops/step_nests.h"

namespace retrograde::lower {

namespace {

// A statement after the steps, and how many of the statements around it (StepConsumers::around) enclose it.
struct Leaf {
  Stmt stmt;
  const ProducerConsumer* produce = nullptr;
  size_t depth = 0;
  bool is_before = false;
};

class ConsumerFinder {
 public:
  ConsumerFinder(const Realize& f, const TimeSteps& steps, const Substitution& lets,
                 const std::function<bool(const std::string&)>& may_move)
      : f_(f), steps_(steps), may_move_(may_move), value_(lets) {}

  std::optional<StepConsumers> find() {
    value_.add(f_.body);
    collect(f_.body);
    const auto form = analysis::decompose(value_(steps_.time), {steps_.loop->name});
    if (!form) return std::nullopt;
    slices_[f_.name] = {steps_.dimension, steps_.sign, form->rest};
    for (Leaf& leaf : leaves_) classify(leaf);
    if (found_.nests.empty()) return std::nullopt;
    finish();
    return found_;
  }

 private:
  const Realize& f_;
  const TimeSteps& steps_;
  const std::function<bool(const std::string&)>& may_move_;
  LetValues value_;
  std::vector<Leaf> leaves_;
  std::vector<Stmt> around_;
  SlicesByFunc slices_;
  std::set<std::string> late_;  // Funcs that are finished after the steps
  StepConsumers found_;

  void collect(const Stmt& s) {
    const auto* part = s.as<ProducerConsumer>();
    if (s.as<LetStmt>() || s.as<Realize>()) {
      around_.push_back(s);
      collect(s.as<LetStmt>() ? s.as<LetStmt>()->body : s.as<Realize>()->body);
    } else if (part && !part->produces) {
      collect(part->body);
    } else if (const auto* block = s.as<Block>()) {
      for (const Stmt& each : block->stmts) collect(each);
    } else if (!part || part->name != f_.name) {
      leaves_.push_back({s, part, around_.size()});
    }
  }

  // ---- one statement ----

  static std::set<std::string> funcs_read(const Stmt& s) {
    std::set<std::string> names;
    walk(s, [&](const Call& call) {
      if (call.call_type == CallType::Func) names.insert(call.name);
    });
    walk(s, [&](const Realize& n) { names.erase(n.name); });
    return names;
  }
  bool reads_late(const Stmt& s) const {
    return std::ranges::any_of(funcs_read(s), [&](const auto& name) { return late_.count(name); });
  }
  bool reads_slices(const Stmt& s) const {
    return std::ranges::any_of(funcs_read(s),
                               [&](const auto& name) { return slices_.count(name); });
  }

  void classify(Leaf& leaf) {
    if (!reads_late(leaf.stmt) && !reads_slices(leaf.stmt)) return;
    if (leaf.produce && !reads_late(leaf.stmt) && join(leaf)) return;
    if (leaf.produce) late_.insert(leaf.produce->name);
    for (const std::string& name : funcs_read(leaf.stmt)) {
      if (auto it = slices_.find(name); it != slices_.end()) it->second.is_read_later = true;
    }
  }

  // Whether the Func's first nests can run before the steps, and all others in them.
  bool join(Leaf& leaf) {
    const std::string& func = leaf.produce->name;
    const auto* block = leaf.produce->body.as<Block>();
    const std::vector<Stmt> nests = block ? block->stmts : std::vector<Stmt>{leaf.produce->body};
    const SlicesByFunc saved = slices_;
    std::vector<Stmt> before;
    std::vector<StepNest> inside;
    bool joins = may_move_(func) && can_move_producers(leaf.stmt, func);
    for (size_t i = 0; i < nests.size() && joins; ++i) {
      if (inside.empty() && !reads_slices(nests[i])) {
        before.push_back(nests[i]);
        continue;
      }
      auto joined = find_step_nest(func, nests[i], *steps_.loop, value_, slices_);
      joins = joined.has_value();
      if (joined) inside.push_back(std::move(*joined));
    }
    const bool has_slices = slices_.count(func) > 0;
    // Slices that take turns in storage cannot have values before the steps.
    if (!joins || inside.empty() || (has_slices && !before.empty())) {
      slices_ = saved;
      return false;
    }
    if (!has_slices) late_.insert(func);
    move_producers(leaf.stmt);
    if (!before.empty())
      found_.before.push_back(make_producer_consumer(func, true, make_block(std::move(before))));
    append(found_.nests, inside);
    found_.moved.push_back(leaf.stmt.get());
    found_.around.assign(around_.begin(), around_.begin() + static_cast<int>(leaf.depth));
    return true;
  }

  Leaf* producer_of(const std::string& func) {
    const auto found = std::ranges::find_if(
        leaves_, [&](const Leaf& leaf) { return leaf.produce && leaf.produce->name == func; });
    return found == leaves_.end() ? nullptr : &*found;
  }

  // Whether all that the statement reads is computed before the storage of f exists, by statements that can move, or in
  // slices.
  bool can_move_producers(const Stmt& s, const std::string& func) {
    return std::ranges::all_of(funcs_read(s), [&](const std::string& name) {
      if (name == func || slices_.count(name)) return true;
      if (const Leaf* leaf = producer_of(name))
        return may_move_(name) && can_move_producers(leaf->stmt, name);
      return !any_stmt(f_.body, [&](const Stmt& part) {
        const auto* storage = part.as<Realize>();
        const auto* store = part.as<Provide>();
        return (storage && storage->name == name) || (store && store->name == name);
      });
    });
  }

  // Moves the statements that compute what a statement reads before the steps.
  void move_producers(const Stmt& s) {
    for (const std::string& name : funcs_read(s)) {
      Leaf* leaf = producer_of(name);
      if (!leaf || leaf->is_before || late_.count(name) || slices_.count(name)) continue;
      leaf->is_before = true;
      move_producers(leaf->stmt);
      found_.before.push_back(leaf->stmt);
      found_.moved.push_back(leaf->stmt.get());
    }
  }

  void finish() {
    for (const auto& [name, slices] : slices_) {
      if (name != f_.name && !slices.is_read_later)
        found_.folds.push_back({name, slices.dimension, slices.most_age + 1});
    }
  }
};

}  // namespace

std::optional<StepConsumers> find_step_consumers(
    const Realize& f, const TimeSteps& steps, const Substitution& lets,
    const std::function<bool(const std::string&)>& may_move) {
  return ConsumerFinder(f, steps, lets, may_move).find();
}

}  // namespace retrograde::lower
