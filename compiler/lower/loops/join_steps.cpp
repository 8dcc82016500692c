#include "lower/loops/join_steps.h"

#include <algorithm>

#include "ir/build.h"
#include "lower/statement_rewriter.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

bool has_other_tasks(const Stmt& nest, const For* loop) {
  return any_node(
      nest, [&](const For& other) { return other.runs == ForType::Parallel && &other != loop; });
}

class StepJoiner {
 public:
  StepJoiner(const Realize& f, const TimeSteps& steps, const StepConsumers& consumers,
             const std::function<bool(const For&)>& is_pure)
      : f_(f), steps_(steps), consumers_(consumers), is_pure_(is_pure) {}

  Stmt run() const {
    Stmt body = rebuilt(f_.body);
    for (auto it = consumers_.around.rbegin(); it != consumers_.around.rend(); ++it)
      body = wrapped(*it, body);
    return with_body(f_, body);
  }

 private:
  const Realize& f_;
  const TimeSteps& steps_;
  const StepConsumers& consumers_;
  const std::function<bool(const For&)>& is_pure_;

  // The body without what moves, and with what moves in its new places.
  Stmt rebuilt(const Stmt& s) const {
    if (std::ranges::count(consumers_.moved, s.get()) > 0) return make_evaluate(0);
    const bool moves_out =
        std::ranges::any_of(consumers_.around, [&](const Stmt& part) { return part.same_as(s); });
    const auto* part = s.as<ProducerConsumer>();
    if (part && part->produces && part->name == f_.name) return with_before(s);
    if (moves_out) return rebuilt(s.as<LetStmt>() ? s.as<LetStmt>()->body : s.as<Realize>()->body);
    if (part && part->produces) return s;
    if (part) return make_producer_consumer(part->name, false, rebuilt(part->body));
    if (const auto* block = s.as<Block>())
      return make_block(mapped(block->stmts, [&](const Stmt& each) { return rebuilt(each); }));
    return s;
  }

  Stmt with_before(const Stmt& produce) const {
    std::vector<Stmt> stmts = consumers_.before;
    stmts.push_back(rewrite_statements(produce, [&](const Stmt& s, auto& all) {
      return s.get() == steps_.loop ? with_consumers() : all.children(s);
    }));
    return make_block(std::move(stmts));
  }

  Stmt with_consumers() const {
    const For& loop = *steps_.loop;
    std::vector<Stmt> body = {loop.body};
    for (const StepNest& nest : consumers_.nests)
      body.push_back(make_producer_consumer(nest.func, true, in_step(nest)));
    return make_for(loop.name, loop.min, loop.extent, loop.runs, make_block(std::move(body)),
                    loop.partition);
  }

  Stmt in_step(const StepNest& nest) const {
    const Expr step = variable(steps_.loop->name);
    if (!nest.over_time) return make_if(simplify(step == nest.offset), nest.nest);
    const bool in_tasks = has_loops(steps_.loop->body, ForType::Parallel);
    const Expr value = simplify((step - nest.offset) * nest.sign);
    return run_iteration(nest.nest, {nest.over_time, value, true, in_tasks}, is_pure_);
  }

  Stmt wrapped(const Stmt& around, const Stmt& body) const {
    if (const auto* let = around.as<LetStmt>()) return make_let(let->name, let->value, body);
    const auto& n = *around.as<Realize>();
    const auto fold = std::ranges::find(consumers_.folds, n.name, &StepConsumers::Fold::func);
    if (fold == consumers_.folds.end() || !n.layout.folds.empty() || !n.layout.place.empty())
      return with_body(n, body);
    StorageLayout layout = n.layout;
    layout.folds.resize(n.bounds.size());
    layout.folds[fold->dimension] = make_const(Int(32), fold->slots);
    return make_realize(n.name, n.types, n.memory, n.bounds, body, layout);
  }
};

}  // namespace

Stmt run_iteration(const Stmt& nest, const OneIteration& one,
                   const std::function<bool(const For&)>& is_pure) {
  bool becomes_parallel =
      one.in_tasks && one.loop->runs == ForType::Parallel && !has_other_tasks(nest, one.loop);
  return rewrite_statements(nest, [&](const Stmt& s, auto& all) {
    const auto* loop = s.as<For>();
    if (loop && loop == one.loop) {
      const Expr v = variable(loop->name);
      Stmt body = all(loop->body);
      if (one.is_checked) body = make_if(v >= loop->min && v < loop->min + loop->extent, body);
      return make_let(loop->name, one.value, body);
    }
    if (loop && becomes_parallel && loop->runs == ForType::Serial && is_pure(*loop)) {
      becomes_parallel = false;
      return make_for(loop->name, loop->min, loop->extent, ForType::Parallel, all(loop->body),
                      loop->partition);
    }
    return all.children(s);
  });
}

Stmt join_steps(const Realize& f, const TimeSteps& steps, const StepConsumers& consumers,
                const std::function<bool(const For&)>& is_pure) {
  return StepJoiner(f, steps, consumers, is_pure).run();
}

}  // namespace retrograde::lower
