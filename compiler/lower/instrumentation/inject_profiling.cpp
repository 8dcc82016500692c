// inject_profiling -- report to the profiler which Func each thread computes, and how much memory is allocated.
// In:  Vector; names unique; nothing freed early yet.
// Out: Vector; the same stores in the same order.
//
//   allocate f[n] {              let profiler.run = begin("pipeline", "overhead\nf\ng")
//     produce f { P }            let profiler.place = thread(profiler.run, overhead)
//     produce g { C }       =>     allocate f[n] { memory(f, 4 n)
//   }                                enter(profiler.place, f) P enter(profiler.place, overhead)
//                                    enter(profiler.place, g) C enter(profiler.place, overhead)
//                                  memory(f, -4 n) }
//                                leave(profiler.place) end(profiler.run)
//
// Method: each thread has a slot in which it writes the number of the Func that it computes; a sampling thread of the
//         runtime reads it. Entering a Func is a single store, emitted inline. So small stages in innermost tiles,
//         which take a few nanoseconds, are not slowed down, and sums around them stay in registers. Bodies of
//         parallel loops and forks use the slot of their own thread. Code generation leaves the slot and ends the run
//         when the function returns early. Allocations that fit on the stack are not counted as memory: reporting
//         one in an innermost tile would take longer than filling it.
// Source: the sampling profiler that Halide's documentation describes. Tests:
//         test/golden/pipeline/inject_profiling/, test/unit/lower/profiler_test.cpp.
#include "lower/instrumentation/inject_profiling.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/runtime_call.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

const char* const run_variable = "profiler.run";
const char* const place_variable = "profiler.place";
constexpr int64_t stack_block_bytes = 16 << 10;

Expr run() { return variable(run_variable, Handle()); }

// Whether the allocation is small enough that code generation usually puts it on the stack.
bool is_small(const Allocate& n) {
  const auto elements = as_const_int(n.elements);
  const int64_t element_bytes = int64_t{n.type.bytes()} * n.type.lanes();
  return elements && n.memory != MemoryType::Heap && *elements <= stack_block_bytes / element_bytes;
}

bool is_element_name(const std::string& name) {
  return name.find_first_not_of("0123456789", name.rfind('.') + 1) == std::string::npos;
}

class Profiling : public StatementRewriter {
 public:
  explicit Profiling(const Program& program) {
    for (const LoopedFunc& f : program.funcs) {
      const int number = static_cast<int>(numbers_.size()) + 1;
      numbers_[f.name()] = number;
      names += "\n" + f.name();
    }
  }
  std::string names = "overhead";  // ordered by number

  // Code that runs on a thread of its own, with its own slot.
  Stmt on_a_thread(const Stmt& s) {
    const std::string outer = place_;
    place_ = places_ == 0 ? place_variable : place_variable + ("." + std::to_string(places_));
    places_++;
    const Expr place =
        call_runtime("retrograde_profiler_thread", {run(), Expr(current_)}, Handle());
    const Stmt body = (*this)(s);
    const Stmt leave = make_evaluate(call_runtime("retrograde_profiler_leave", {this->place()}));
    const Stmt result = make_let(place_, place, make_block({body, leave}));
    place_ = outer;
    return result;
  }

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (const ProducerConsumer* n = s.as<ProducerConsumer>(); n && n->produces) return produce(*n);
    if (const For* n = s.as<For>(); n && runs_at_once(n->runs))
      return map_children(s, [&](const Stmt& body) { return on_a_thread(body); });
    if (s.kind() == Kind::Launch) return s;  // a kernel allocates no host memory
    if (const Fork* n = s.as<Fork>()) return make_fork(on_a_thread(n->first), (*this)(n->rest));
    if (const Allocate* n = s.as<Allocate>()) return allocate(*n);
    return children(s);
  }

 private:
  std::map<std::string, int> numbers_;  // of Funcs
  int current_ = 0;
  std::string place_;  // the variable that holds this thread's slot
  int places_ = 0;

  Expr place() const { return variable(place_, Handle()); }
  Stmt enter(int number) const {
    return make_evaluate(call_runtime("retrograde_profiler_enter", {place(), Expr(number)}));
  }

  // The Func "f" also has the names "f.$1", of a copy, and "f.0" and "f.$1.0", of the values of a Tuple.
  int number_of(const std::string& name) const {
    const auto found = numbers_.find(original_name(name));
    if (found != numbers_.end()) return found->second;
    const std::string func = name.substr(0, name.rfind('.'));
    return is_element_name(name) ? value_or(numbers_, original_name(func), 0) : 0;
  }

  Stmt produce(const ProducerConsumer& n) {
    const int outer = current_;
    current_ = number_of(n.name);
    const Stmt body = make_block({enter(current_), (*this)(n.body), enter(outer)});
    current_ = outer;
    return make_producer_consumer(n.name, true, body);
  }

  Stmt allocate(const Allocate& n) {
    if (is_small(n)) return make_allocate(n.name, n.type, n.memory, n.elements, (*this)(n.body));
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

// Wraps the smallest statement that contains all work: after the checks of arguments, on the path that is not a bounds
// query.
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
    return make_let(run_variable, begin,
                    make_block({profiling.on_a_thread(work),
                                make_evaluate(call_runtime("retrograde_profiler_end", {run()}))}));
  };
  return wrap_work(s, wrap);
}

}  // namespace retrograde::lower
