// loop_level.h -- LoopLevel, the place at which a Func is computed or stored.
//
// LoopLevel is a handle: copies are the same level, and set() changes it in every schedule that uses it. So a library
// can use a level that its caller decides later:
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

// A place to compute or store a Func: a loop of another Func, root, or inline.
class LoopLevel {
 public:
  // An undefined level, to be set before the pipeline is compiled.
  LoopLevel();
  // The loop `var` of stage `stage_index` of `f`; -1 means any stage that has this loop.
  LoopLevel(const Func& f, const VarOrRVar& var, int stage_index = -1);
  static LoopLevel inlined();  // in each use
  static LoopLevel root();     // outside of all loops

  // Changes this level, for all of its handles, to `other`.
  // Requires: a locked level does not change; a level is a loop, root or inlined.
  void set(const LoopLevel& other);
  // Makes later calls of set() an error.
  // Requires: a level is a loop, root or inlined.
  LoopLevel& lock();

  bool defined() const { return contents_->defined; }  // whether it was set
  // Whether it means in each use.
  bool is_inlined() const { return level().kind == graph::LoopLevel::Kind::Inlined; }
  // Whether it means outside of all loops.
  bool is_root() const { return level().kind == graph::LoopLevel::Kind::Root; }
  // Name of the Func whose loop it is.
  // Requires: the level is a loop of a Func.
  std::string func() const;
  VarOrRVar var() const;          // variable of the loop
  int stage_index() const;        // stage that has the loop; -1: any
  std::string to_string() const;  // "f.x", "root" or "inlined"
  // Whether both denote the same place.
  bool operator==(const LoopLevel& other) const { return level() == other.level(); }
  // Whether they denote different places.
  bool operator!=(const LoopLevel& other) const { return !(*this == other); }

  // The record that handles share.
  const std::shared_ptr<graph::LoopLevelContents>& contents() const { return contents_; }

 private:
  explicit LoopLevel(graph::LoopLevel level);
  const graph::LoopLevel& level() const;  // throws CompileError if undefined
  const graph::LoopLevel& loop(const char* asked) const;
  std::shared_ptr<graph::LoopLevelContents> contents_;
};

}  // namespace retrograde
