// loop_level.h -- a loop of a Func, or root, or inline: where another Func is computed or stored.
//
// An object is a handle: copies are the same level, and set() changes it for every schedule that
// was given it, so that a library can take a level from its caller before the caller knows it:
//
//   LoopLevel at;                  // undefined
//   helper.compute_at(at);
//   at.set(LoopLevel(output, y));  // now helper is computed in the loop y of output
#pragma once

#include <memory>
#include <string>

#include "frontend/language/var_or_rvar.h"
#include "graph/function.h"

namespace retrograde {

class Func;

class LoopLevel {
 public:
  LoopLevel();  // undefined: to be set before the pipeline is compiled
  // `stage_index`: of which stage of f; -1: of any that has the loop.
  LoopLevel(const Func& f, const VarOrRVar& var, int stage_index = -1);
  static LoopLevel inlined();  // in each use
  static LoopLevel root();     // outside of all loops

  // From now on this is the level `other`.
  // Requires: a locked level does not change; a level is a loop, root or inlined.
  void set(const LoopLevel& other);
  // Requires: a level is a loop, root or inlined.
  LoopLevel& lock();  // set() is an error from now on

  bool defined() const { return contents_->defined; }  // whether it was set
  // in each use
  bool is_inlined() const { return level().kind == graph::LoopLevel::Kind::Inlined; }
  // Outside of all loops.
  bool is_root() const { return level().kind == graph::LoopLevel::Kind::Root; }
  // Requires: the level is a loop of a Func.
  std::string func() const;       // whose loop it is
  VarOrRVar var() const;          // which loop it is
  int stage_index() const;        // of which stage; -1: of any
  std::string to_string() const;  // "f.x", "root", "inlined"
  bool operator==(const LoopLevel& other) const { return level() == other.level(); }
  bool operator!=(const LoopLevel& other) const { return !(*this == other); }

  const std::shared_ptr<graph::LoopLevelContents>& contents() const { return contents_; }

 private:
  explicit LoopLevel(graph::LoopLevel level);
  const graph::LoopLevel& level() const;  // CompileError when undefined
  const graph::LoopLevel& loop(const char* asked) const;
  std::shared_ptr<graph::LoopLevelContents> contents_;
};

}  // namespace retrograde
