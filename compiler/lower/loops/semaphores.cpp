#include "lower/loops/semaphores.h"

#include "ir/build.h"
#include "lower/runtime_call.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

constexpr int per_reader = 2;

std::string semaphores_of(const std::string& func) { return func + ".semaphores"; }

Stmt call(const char* function, const std::string& func, int which, int count) {
  const Expr place = call_op(
      Op::address_of, Handle(),
      {call_func(semaphores_of(func), UInt(64), {Expr(static_cast<int32_t>(which))}, 0, {})});
  return make_evaluate(call_runtime(function, {place, Expr(count)}));
}

// The first access of the Func's semaphores in the step; undefined if there is none.
Expr semaphore_in(const Stmt& step, const std::string& func) {
  Expr found;
  walk(
      step,
      [&](const Expr& e) {
        const Call* call = e.as<Call>();
        if (call && call->call_type == CallType::Func && call->name == semaphores_of(func))
          found = e;
        return !found.defined();
      },
      [](const Stmt& part) {
        return part.kind() == Kind::LetStmt || part.kind() == Kind::Evaluate ||
               part.kind() == Kind::Assert;
      });
  return found;
}

}  // namespace

Stmt Semaphores::acquire(const std::string& func, int which) {
  return checked_call(fresh_(func + ".waited"),
                      call("retrograde_semaphore_acquire", func, which, 1).as<Evaluate>()->value);
}

Stmt Semaphores::release(const std::string& func, int which) {
  return call("retrograde_semaphore_release", func, which, 1);
}

bool Semaphores::is_step(const Stmt& s, const std::string& func) {
  const LetStmt* let = s.as<LetStmt>();
  const bool has_form = let ? let->body.kind() == Kind::Assert : s.kind() == Kind::Evaluate;
  return has_form && semaphore_in(s, func).defined();
}

bool Semaphores::has_steps(const Stmt& s, const std::string& func) {
  return any_stmt(s, [&](const Stmt& part) { return is_step(part, func); });
}

Stmt Semaphores::replace_steps(const Stmt& s, const std::string& func,
                               FunctionRef<Stmt(const Stmt&)> replace) {
  return rewrite_statements(s, [&](const Stmt& part, auto& all) {
    return is_step(part, func) ? replace(part) : all.children(part);
  });
}

Stmt Semaphores::of_reader(const Stmt& step, const std::string& func, int reader) {
  const Expr index = semaphore_in(step, func).as<Call>()->args[0];
  const int which = per_reader * reader + static_cast<int>(*as_const_int(index)) % per_reader;
  return step.kind() == Kind::LetStmt ? acquire(func, which) : release(func, which);
}

Stmt Semaphores::for_readers(const Stmt& producer, const std::string& func, int readers) {
  if (readers == 1) return producer;
  return replace_steps(producer, func, [&](const Stmt& step) {
    return make_block(numbered(readers, [&](int i) { return of_reader(step, func, i); }));
  });
}

Stmt Semaphores::around(const Stmt& fork, const std::string& func, int room, int readers) {
  std::vector<Stmt> stmts;
  for (int i = 0; i < readers; i++) {
    stmts.push_back(call("retrograde_semaphore_init", func, per_reader * i + Ready, 0));
    stmts.push_back(call("retrograde_semaphore_init", func, per_reader * i + Space, room));
  }
  stmts.push_back(fork);
  return make_realize(semaphores_of(func), {UInt(64)}, MemoryType::Stack,
                      {Range{0, per_reader * readers}}, make_block(stmts));
}

}  // namespace retrograde::lower
