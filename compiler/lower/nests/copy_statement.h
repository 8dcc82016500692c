// Copies statements for passes that run a body several times. Names stay unique because every copy binds fresh names.
// Fresh names depend on the program alone, so that passes are deterministic.
#pragma once

#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "ir/expr.h"
#include "ir/visit.h"

namespace retrograde::lower {

// Generates names that occur nowhere in a statement: "f.s0.x" and "f.s0.x.$1" give "f.s0.x.$2", "f.s0.x.$3", ...
class FreshNames {
 public:
  explicit FreshNames(Stmt s) : program_(std::move(s)) {}
  std::string operator()(const std::string& model);

 private:
  void read_program();
  Stmt
      program_;  // read when the first name is requested: most passes leave most programs unchanged
  std::unordered_set<std::string> taken_;
  std::unordered_map<std::string, int> next_;
};

// The statement with `values` substituted and every name that it binds (lets, loops, allocations)
// replaced by a fresh one.
Stmt copy_statement(const Stmt& s, FreshNames& fresh, const Substitution& values = {});

// The parts of a loop's name as the user knows them: "f.s1.x" is the loop over "x" in stage 1 of "f".
struct LoopName {
  std::string func, stage, var;
};
// Ignores the number of a copy.
LoopName decode_loop_name(const std::string& loop);
// `"x" of "f"`, with the number of the update if the stage is one.
std::string describe_loop(const std::string& loop);

}  // namespace retrograde::lower
