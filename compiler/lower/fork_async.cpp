// fork_async -- producers that run at the same time as their consumers.
// In:  Loops; names unique.
// Out: Loops; every async Func is produced in one branch of a Fork and consumed in the other.
//
//   realize f {                      realize f { realize f.semaphores {
//     produce f { P }                  fork { produce f { P }  release ready }
//     consume f { A; B(f) }      =>         { A; acquire ready; B(f) }
//   }                                } }
//
//   realize f { for y {              realize f { realize f.semaphores {
//     produce f { P(y) }               fork { for y { acquire space; P(y); release ready } }
//     consume f { B(f, y) }      =>         { for y { acquire ready; B(f, y); release space } }
//   } }                              } }
//
// Method: in the second form both branches keep the loops between the storage and the computation,
//         each without the other's work; `space` starts with the number of iterations that the
//         producer may be ahead, which build_loop_nests knows from the folding, or is left out
//         where nothing that is still read is ever overwritten. Storage of several async Funcs
//         nests, and so do the Forks: outermost first, each next one splits the branch that
//         consumes.
// Errors: a producer that shares the inner loops with another that it reads and that is not async;
//         two branches that both read a third async Func.
// Source: Halide's documentation of async; the handshake is a bounded buffer's (Dijkstra 1965).
// Tests: test/unit/async_test.cpp.
#include "lower/fork_async.h"

#include <algorithm>
#include <utility>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/copy_statement.h"

namespace retrograde::ir {

namespace {

std::string semaphores_of(const std::string& func) { return func + ".semaphores"; }

enum Semaphore { Ready = 0, Space = 1 };

bool is_semaphore_step(const Stmt& s, const std::string& func) {
  bool found = false;
  walk(
      s,
      [&](const Expr& e) {
        const Call* call = e.as<Call>();
        found |= call && call->call_type == CallType::Func && call->name == semaphores_of(func);
        return !found;
      },
      [](const Stmt& part) {
        return part.kind() == Kind::LetStmt || part.kind() == Kind::Evaluate ||
               part.kind() == Kind::Assert;
      });
  return found;
}

// Whether the expression or statement reads or writes the Func.
struct UseFinder {
  const std::string& func;
  bool found = false;

  bool visit(const Expr& e) {
    const Call* call = e.as<Call>();
    const Variable* variable = e.as<Variable>();
    found |= call && call->call_type == CallType::Func && call->name == func;
    found |= variable && variable->name.rfind(func + ".stride.", 0) == 0;
    return !found;
  }
  bool visit(const Stmt& s) {
    const Provide* provide = s.as<Provide>();
    const Prefetch* prefetch = s.as<Prefetch>();
    found |= (provide && provide->name == func) || (prefetch && prefetch->name == func);
    return !found;
  }
};

template <class Tree>
bool uses_func(const Tree& tree, const std::string& func) {
  UseFinder finder{func};
  if constexpr (std::is_same_v<Tree, Expr>) {
    walk(tree, [&](const Expr& e) { return finder.visit(e); });
  } else {
    walk(
        tree, [&](const Expr& e) { return finder.visit(e); },
        [&](const Stmt& s) { return finder.visit(s); });
  }
  return finder.found;
}

bool is_producer_of(const Stmt& s, const std::string& func) {
  const ProducerConsumer* n = s.as<ProducerConsumer>();
  return n && n->is_producer && n->name == func;
}

bool produces(const Stmt& s, const std::string& func) {
  bool found = false;
  walk(
      s, [](const Expr&) { return false; },
      [&](const Stmt& part) {
        found |= is_producer_of(part, func);
        return !found;
      });
  return found;
}

// A loop around the producer, inside of `s`.
bool has_loop_around(const Stmt& s, const std::string& func) {
  bool found = false;
  walk(
      s, [](const Expr&) { return false; },
      [&](const Stmt& part) {
        if (is_producer_of(part, func)) return false;
        found |= part.kind() == Kind::For && produces(part, func);
        return !found;
      });
  return found;
}

class AsyncForker : public Rewriter {
 public:
  AsyncForker(const Stmt& s, const Program& program, const RenamedFuncs& renamed,
              const AsyncRoom& room)
      : program_(program), renamed_(renamed), room_(room), fresh_(s) {}

 protected:
  Expr rewrite(const Expr& e) override { return e; }

  Stmt rewrite(const Stmt& given) override {
    const Stmt s = producers_outermost(given);
    const Realize* n = s.as<Realize>();
    if (!n || !is_async(n->name) || !produces(n->body, n->name)) return children(s);
    const Stmt body = has_loop_around(n->body, n->name) ? fork_loops(*n) : fork_once(*n);
    return make_realize(n->name, n->types, n->memory, n->bounds, body);
  }

 private:
  const Program& program_;
  const RenamedFuncs& renamed_;
  const AsyncRoom& room_;
  FreshNames fresh_;
  Substitution own_names_;
  std::vector<std::string> forked_;  // async Funcs around whose consumers this is

  const std::string& original(const std::string& name) const {
    const auto it = renamed_.find(name);
    return it == renamed_.end() ? name : it->second;
  }
  bool is_async(const std::string& name) const {
    const LoopedFunc* f = program_.find(original(name));
    return f && f->schedule.async;
  }

  // Realizes directly inside each other, those of producers around those of what reads them.
  Stmt producers_outermost(const Stmt& s) const {
    std::vector<const Realize*> chain;
    for (const Realize* n = s.as<Realize>(); n; n = n->body.as<Realize>()) chain.push_back(n);
    if (chain.size() < 2) return s;
    const Stmt body = chain.back()->body;
    const auto position = [&](const Realize* n) {
      const auto it = program_.index_of.find(original(n->name));
      return it == program_.index_of.end() ? -1 : it->second;
    };
    std::stable_sort(chain.begin(), chain.end(),
                     [&](const Realize* a, const Realize* b) { return position(a) < position(b); });
    Stmt result = body;
    for (size_t i = chain.size(); i-- > 0;)
      result =
          make_realize(chain[i]->name, chain[i]->types, chain[i]->memory, chain[i]->bounds, result);
    return result;
  }

  // Work that the producer's branch leaves out and the producer needs.
  static void check_is_complete(const Realize& n, const Stmt& producer) {
    walk(
        n.body, [](const Expr&) { return false; },
        [&](const Stmt& part) {
          if (is_producer_of(part, n.name)) return false;
          const ProducerConsumer* other = part.as<ProducerConsumer>();
          if (!other || !other->is_producer || !uses_func(producer, other->name)) return true;
          if (produces(part, n.name)) return true;
          unsupported(text("compute ", quoted(n.name), " async"),
                      "what an async Func reads is computed outside of the loops that it shares "
                      "with its consumer, inside its own, or async itself",
                      text(quoted(other->name), " is computed in these loops, and ", quoted(n.name),
                           " reads it"),
                      text("Compute ", quoted(other->name), " at root or at a loop of ",
                           quoted(n.name), ", or call async() on it"));
          return false;
        });
  }

  // ---- semaphores ----

  static Expr call(const char* function, const std::string& func, Semaphore which, int count) {
    const Expr place = call_op(
        Op::address_of, Handle(),
        {call_func(semaphores_of(func), UInt(64), {Expr(static_cast<int32_t>(which))}, 0, {})});
    return call_op(Op::runtime_call, Int(32), {Expr(function), place, Expr(count)});
  }

  Stmt acquire(const std::string& func, Semaphore which) {
    const std::string code = fresh_(func + ".waited");
    return make_let(code, call("retrograde_semaphore_acquire", func, which, 1),
                    make_assert(variable(code) == 0, variable(code)));
  }

  static Stmt release(const std::string& func, Semaphore which) {
    return make_evaluate(call("retrograde_semaphore_release", func, which, 1));
  }

  static Stmt with_semaphores(const std::string& func, int room, const Stmt& fork) {
    const Stmt start =
        make_block({make_evaluate(call("retrograde_semaphore_init", func, Ready, 0)),
                    make_evaluate(call("retrograde_semaphore_init", func, Space, room)), fork});
    return make_realize(semaphores_of(func), {UInt(64)}, MemoryType::Stack, {Range{0, 2}}, start);
  }

  // ---- produced once ----

  Stmt fork_once(const Realize& n) {
    Stmt producer = only_producer(n.body, n.name, false);
    Stmt consumer = without_producer(n.body, n.name, false);
    if (!consumer.defined()) return children(n.body);
    producer = with_own_names(producer);
    consumer = acquired_late(consumer, n.name);
    return with_semaphores(
        n.name, 0,
        make_fork(make_block({(*this)(producer), release(n.name, Ready)}), (*this)(consumer)));
  }

  // A producer that does not run when its result is in the cache.
  bool may_be_skipped(const ProducerConsumer& n) const {
    const LoopedFunc* f = program_.find(original(n.name));
    return n.is_producer && f && f->schedule.memoized;
  }

  // Waits as late as possible: what does not need the Func runs before.
  Stmt acquired_late(const Stmt& s, const std::string& func) {
    if (const ProducerConsumer* n = s.as<ProducerConsumer>(); n && !may_be_skipped(*n))
      return make_producer_consumer(n->name, n->is_producer, acquired_late(n->body, func));
    if (const LetStmt* n = s.as<LetStmt>(); n && !uses_func(n->value, func))
      return make_let(n->name, n->value, acquired_late(n->body, func));
    if (const Realize* n = s.as<Realize>(); n && !bounds_use(*n, func))
      return make_realize(n->name, n->types, n->memory, n->bounds, acquired_late(n->body, func));
    if (const Block* n = s.as<Block>()) {
      std::vector<Stmt> stmts = n->stmts;
      for (Stmt& part : stmts) {
        if (!uses_func(part, func)) continue;
        part = acquired_late(part, func);
        return make_block(std::move(stmts));
      }
    }
    return make_block({acquire(func, Ready), s});
  }

  static bool bounds_use(const Realize& n, const std::string& func) {
    for (const Range& range : n.bounds) {
      if (uses_func(range.min, func) || uses_func(range.extent, func)) return true;
    }
    return false;
  }

  // ---- produced in a loop ----

  Stmt fork_loops(const Realize& n) {
    const auto found = room_.find(original(n.name));
    const int room = found == room_.end() ? 1 : found->second;
    Stmt producer = only_producer(n.body, n.name, true, room);
    Stmt consumer = without_producer(n.body, n.name, true, room);
    check_is_complete(n, producer);
    share_waits(n.name, producer, consumer);
    producer = with_own_names(producer);
    forked_.push_back(n.name);
    Stmt fork = make_fork((*this)(producer), (*this)(consumer));
    forked_.pop_back();
    return with_semaphores(n.name, room, fork);
  }

  // The handshake of an async Func around belongs to the branch that reads it.
  void share_waits(const std::string& func, Stmt& producer, Stmt& consumer) const {
    for (const std::string& outer : forked_) {
      const bool in_producer = uses_func(producer, outer), in_consumer = uses_func(consumer, outer);
      if (in_producer && in_consumer) {
        unsupported(text("compute ", quoted(func), " async"),
                    "an async Func that is computed in a loop is read by one thread",
                    text(quoted(outer), " is read by ", quoted(func), " and by its consumer"),
                    text("Leave out async() of ", quoted(outer), " or of ", quoted(func)));
      }
      Stmt& other = in_producer ? consumer : producer;
      other = without_waits(other, outer);
    }
  }

  static Stmt without_waits(const Stmt& s, const std::string& func) {
    struct Remover : Rewriter {
      explicit Remover(const std::string& func) : func(func) {}
      const std::string& func;
      Expr rewrite(const Expr& e) override { return e; }
      Stmt rewrite(const Stmt& s) override {
        const bool is_step = s.kind() == Kind::LetStmt || s.kind() == Kind::Evaluate;
        if (is_step && is_semaphore_step(s, func)) {
          const LetStmt* let = s.as<LetStmt>();
          if (!let || let->body.kind() == Kind::Assert) return make_evaluate(0);
        }
        return children(s);
      }
    };
    return Remover(func)(s);
  }

  // The body of the innermost loop around the producer, with its waits.
  Stmt shake_hands(const Stmt& body, const std::string& func, bool is_producer, int room) {
    const Semaphore before = is_producer ? Space : Ready, after = is_producer ? Ready : Space;
    std::vector<Stmt> stmts;
    if (before == Ready || room > 0) stmts.push_back(acquire(func, before));
    if (body.defined()) stmts.push_back(body);
    if (after == Ready || room > 0) stmts.push_back(release(func, after));
    return make_block(std::move(stmts));
  }

  bool is_innermost_around(const For& n, const std::string& func) const {
    return produces(n.body, func) && !has_loop_around(n.body, func);
  }

  static void check_serial(const For& n, const std::string& func) {
    if (n.for_type == ForType::Serial) return;
    unsupported(text("compute ", quoted(func), " async"),
                "the loops between storage and computation of an async Func are serial",
                text("the loop over ", quoted(n.name), " is not"),
                "Store the Func inside of that loop");
  }

  // Loops and lets that both branches have get new names in the producer's.
  std::string own_name(const std::string& name, Type type) {
    const std::string fresh = fresh_(name);
    own_names_[name] = variable(fresh, type);
    return fresh;
  }
  Stmt with_own_names(const Stmt& producer) {
    const Substitution names = std::exchange(own_names_, {});
    return substitute(producer, names);
  }

  // Just the work of the producer, and the control around it. Undefined where there is none.
  Stmt only_producer(const Stmt& s, const std::string& func, bool loops, int room = 0) {
    if (!s.defined() || !produces(s, func)) return {};
    if (is_producer_of(s, func)) return s;
    return match(
        s,
        [&](const For& n) {
          check_serial(n, func);
          Stmt body = only_producer(n.body, func, loops, room);
          if (loops && is_innermost_around(n, func)) body = shake_hands(body, func, true, room);
          return make_for(own_name(n.name, n.min.type()), n.min, n.extent, n.for_type, body,
                          n.partition);
        },
        [&](const LetStmt& n) {
          return make_let(own_name(n.name, n.value.type()), n.value,
                          only_producer(n.body, func, loops, room));
        },
        [&](const IfThenElse& n) {
          Stmt then_case = only_producer(n.then_case, func, loops, room);
          Stmt else_case = only_producer(n.else_case, func, loops, room);
          if (!then_case.defined()) return make_if(!n.condition, else_case);
          return make_if(n.condition, then_case, else_case);
        },
        [&](const Block& n) {
          std::vector<Stmt> stmts;
          for (const Stmt& part : n.stmts) {
            if (is_wait(part)) {
              stmts.push_back(part);
            } else {
              stmts.push_back(only_producer(part, func, loops, room));
            }
          }
          return make_block(std::move(stmts));
        },
        [&](const ProducerConsumer& n) { return only_producer(n.body, func, loops, room); },
        [&](const Realize& n) {
          Stmt body = only_producer(n.body, func, loops, room);
          if (!uses_func(body, n.name)) return body;
          return make_realize(n.name, n.types, n.memory, n.bounds, body);
        },
        [&](const StmtNode&) { return s; });
  }

  bool is_wait(const Stmt& s) const {
    for (const std::string& func : forked_) {
      if ((s.kind() == Kind::LetStmt || s.kind() == Kind::Evaluate) && is_semaphore_step(s, func))
        return true;
    }
    return false;
  }

  // Everything but the work of the producer.
  Stmt without_producer(const Stmt& s, const std::string& func, bool loops, int room = 0) {
    if (!s.defined() || !produces(s, func)) return s;
    if (is_producer_of(s, func)) return {};
    return match(
        s,
        [&](const For& n) {
          Stmt body = without_producer(n.body, func, loops, room);
          if (loops && is_innermost_around(n, func)) body = shake_hands(body, func, false, room);
          return make_for(n.name, n.min, n.extent, n.for_type, body, n.partition);
        },
        [&](const LetStmt& n) {
          Stmt body = without_producer(n.body, func, loops, room);
          return body.defined() ? make_let(n.name, n.value, body) : body;
        },
        [&](const IfThenElse& n) {
          Stmt then_case = without_producer(n.then_case, func, loops, room);
          Stmt else_case = without_producer(n.else_case, func, loops, room);
          if (!then_case.defined() && !else_case.defined()) return then_case;
          if (!then_case.defined()) return make_if(!n.condition, else_case);
          return make_if(n.condition, then_case, else_case);
        },
        [&](const Block& n) {
          std::vector<Stmt> stmts;
          for (const Stmt& part : n.stmts)
            stmts.push_back(without_producer(part, func, loops, room));
          return make_block(std::move(stmts));
        },
        [&](const ProducerConsumer& n) {
          Stmt body = without_producer(n.body, func, loops, room);
          return body.defined() ? make_producer_consumer(n.name, n.is_producer, body) : body;
        },
        [&](const Realize& n) {
          Stmt body = without_producer(n.body, func, loops, room);
          if (!body.defined() || !uses_func(body, n.name)) return body;
          return make_realize(n.name, n.types, n.memory, n.bounds, body);
        },
        [&](const StmtNode&) { return s; });
  }
};

}  // namespace

Stmt fork_async(const Stmt& s, const Program& program, const RenamedFuncs& renamed,
                const AsyncRoom& room) {
  for (const LoopedFunc& f : program.funcs) {
    if (f.schedule.async) return AsyncForker(s, program, renamed, room)(s);
  }
  return s;
}

}  // namespace retrograde::ir
