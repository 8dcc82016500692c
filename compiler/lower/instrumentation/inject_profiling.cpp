// inject_profiling -- tell the profiler which Func is being computed, by how many threads, in how
// much memory.
// In:  Vector; names unique; nothing freed early yet.
// Out: Vector; the same stores in the same order.
//
//   allocate f[n] {              let profiler.run = begin("pipeline", "overhead\nf\ng")
//     produce f { P }              allocate f[n] { memory(f, 4 n)
//     produce g { C }       =>       enter(f) P enter(overhead)
//   }                                enter(g) C enter(overhead)
//                                  memory(f, -4 n) }
//                                end(profiler.run)
//
// Method: what is entered is a number that a sampling thread of the runtime reads; entering costs a
//         call and a store. Bodies of parallel loops enter again, since their threads may come from
//         elsewhere. Code generation ends the run when the function leaves early.
// Source: the sampling profiler that Halide's documentation describes. Tests:
//         test/golden/pipeline/inject_profiling/, test/unit/profiler_test.cpp.
#include "lower/instrumentation/inject_profiling.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/runtime_call.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

const char* const run_name = "profiler.run";

Expr run() { return variable(run_name, Handle()); }

class Profiling : public StatementRewriter {
 public:
  explicit Profiling(const Program& program) {
    for (const LoopedFunc& f : program.funcs) add(f, f.name());
    for (const auto& [name, original] : program.renamed) {
      if (const LoopedFunc* f = program.find(original)) add(*f, name);
    }
    names = "overhead";
    for (const LoopedFunc& f : program.funcs) names += "\n" + f.name();
  }
  std::string names;  // by number

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (const ProducerConsumer* n = s.as<ProducerConsumer>(); n && n->produces) return produce(*n);
    if (const For* n = s.as<For>(); n && n->runs == ForType::Parallel)
      return map_children(s, [&](const Stmt& body) { return on_a_thread((*this)(body)); });
    if (const Fork* n = s.as<Fork>())
      return make_fork(on_a_thread((*this)(n->first)), (*this)(n->rest));
    if (const Allocate* n = s.as<Allocate>()) return allocate(*n);
    return children(s);
  }

 private:
  std::map<std::string, int> numbers_;  // of Funcs, and of the memory of their values
  int current_ = 0;

  void add(const LoopedFunc& f, const std::string& name) {
    const auto it = numbers_.find(f.name());
    const int number = it == numbers_.end() ? next_++ : it->second;
    numbers_[name] = number;
    for (size_t i = 0; i < f.func->types.size(); i++)
      numbers_[name + "." + std::to_string(i)] = number;
  }
  int next_ = 1;

  static Stmt enter(int number) {
    return make_evaluate(call_runtime("retrograde_profiler_enter", {run(), Expr(number)}));
  }
  static Stmt thread(int change) {
    return make_evaluate(call_runtime("retrograde_profiler_thread", {run(), Expr(change)}));
  }

  int number_of(const std::string& name) const { return value_or(numbers_, name, 0); }

  Stmt produce(const ProducerConsumer& n) {
    const int outer = current_;
    current_ = number_of(n.name);
    const Stmt body = make_block({enter(current_), (*this)(n.body), enter(outer)});
    current_ = outer;
    return make_producer_consumer(n.name, true, body);
  }

  Stmt on_a_thread(const Stmt& body) const {
    return make_block({thread(1), enter(current_), body, thread(-1)});
  }

  Stmt allocate(const Allocate& n) {
    const Expr bytes = n.elements * make_const(Int(64), n.type.bytes());
    const auto memory = [&](const Expr& change) {
      return make_evaluate(
          call_runtime("retrograde_profiler_memory", {run(), Expr(number_of(n.name)), change}));
    };
    const Stmt body =
        make_block({memory(bytes), (*this)(n.body), memory(make_const(Int(64), 0) - bytes)});
    return make_allocate(n.name, n.type, n.memory, n.elements, body);
  }
};

bool is_work(const Stmt& s) {
  return s.kind() == Kind::ProducerConsumer || s.kind() == Kind::Allocate ||
         s.kind() == Kind::Fork || s.kind() == Kind::For;
}

bool has_work(const Stmt& s) {
  return any_stmt(s, [](const Stmt& part) { return is_work(part); });
}

// Wraps the smallest statement that holds all work: behind the checks of arguments, where no bounds
// are asked for.
Stmt wrap_work(const Stmt& s, FunctionRef<Stmt(const Stmt&)> wrap) {
  if (!s.defined() || !has_work(s)) return s;
  if (is_work(s)) return wrap(s);
  int parts = 0;
  for_each_child(
      s, [](const Expr&) {}, [&](const Stmt& part) { parts += has_work(part); });
  if (parts == 1) {
    return map_children(s, [&](const Stmt& part) { return wrap_work(part, wrap); });
  }
  const Block* block = s.as<Block>();
  if (!block) return wrap(s);
  const auto first = std::find_if(block->stmts.begin(), block->stmts.end(), has_work);
  std::vector<Stmt> stmts(block->stmts.begin(), first);
  stmts.push_back(wrap(make_block({first, block->stmts.end()})));
  return make_block(std::move(stmts));
}

}  // namespace

Stmt inject_profiling(const Stmt& s, const Program& program, const std::string& pipeline) {
  Profiling profiling(program);
  const auto wrap = [&](const Stmt& work) {
    const Expr begin = call_runtime("retrograde_profiler_begin",
                                    {Expr(pipeline), Expr(profiling.names)}, Handle());
    return make_let(run_name, begin,
                    make_block({profiling(work),
                                make_evaluate(call_runtime("retrograde_profiler_end", {run()}))}));
  };
  return wrap_work(s, wrap);
}

}  // namespace retrograde::lower
