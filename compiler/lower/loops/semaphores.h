// semaphores.h -- the waits and signals between the branches of a Fork (fork_async.h). A Func that is
// computed async has two semaphores for each of its readers: results that are ready, and room for
// more.
#pragma once

#include <string>

#include "ir/expr.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"

namespace retrograde::lower {

// Of one reader; those of the next follow.
enum Semaphore { Ready = 0, Space = 1 };

class Semaphores {
 public:
  explicit Semaphores(const Stmt& s) : fresh_(s) {}

  // Steps: a wait, which leaves the function when the other branch has failed, and a signal.
  Stmt acquire(const std::string& func, int which);
  static Stmt release(const std::string& func, int which);
  static bool is_step(const Stmt& s, const std::string& func);
  static bool has_steps(const Stmt& s, const std::string& func);
  // Each step of the Func replaced. Undefined: stays so.
  static Stmt replace_steps(const Stmt& s, const std::string& func,
                            FunctionRef<Stmt(const Stmt&)> replace);

  // The same step with the semaphores of another reader.
  Stmt of_reader(const Stmt& step, const std::string& func, int reader);
  // Steps that the producer makes with each of its readers.
  Stmt for_readers(const Stmt& producer, const std::string& func, int readers);
  // The semaphores of a Func, and the Fork that uses them.
  static Stmt around(const Stmt& fork, const std::string& func, int room, int readers);

 private:
  FreshNames fresh_;
};

}  // namespace retrograde::lower
