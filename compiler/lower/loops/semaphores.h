// semaphores.h -- builds the waits and signals between the branches of a Fork (fork_async.h). An async Func has two
// semaphores for each of its readers: one counts available results, one counts free slots.
#pragma once

#include <string>

#include "ir/expr.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"

namespace retrograde::lower {

// Indices of one reader's semaphores; those of the next reader follow.
enum Semaphore { Ready = 0, Space = 1 };

class Semaphores {
 public:
  explicit Semaphores(const Stmt& s) : fresh_(s) {}

  // Steps. A wait returns from the function with an error if the other branch has failed.
  Stmt acquire(const std::string& func, int which);
  static Stmt release(const std::string& func, int which);
  static bool is_step(const Stmt& s, const std::string& func);
  static bool has_steps(const Stmt& s, const std::string& func);
  // Replaces each step of the Func. A step for which `replace` returns an undefined statement stays.
  static Stmt replace_steps(const Stmt& s, const std::string& func,
                            FunctionRef<Stmt(const Stmt&)> replace);

  // The same step with the semaphores of another reader.
  Stmt of_reader(const Stmt& step, const std::string& func, int reader);
  // The producer, whose steps signal or await each of its readers.
  Stmt for_readers(const Stmt& producer, const std::string& func, int readers);
  // Allocates and initialises the semaphores of a Func around the Fork that uses them.
  static Stmt around(const Stmt& fork, const std::string& func, int room, int readers);

 private:
  FreshNames fresh_;
};

}  // namespace retrograde::lower
