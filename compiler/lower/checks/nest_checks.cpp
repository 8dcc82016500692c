#include "lower/checks/nest_checks.h"

#include "diagnostics/error.h"
#include "lower/checks/run_time_check.h"
#include "retrograde_runtime.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

// The Func of the program that f is the adjoint of; empty if it is none.
std::string adjoint_of(const FuncContents& f) {
  return f.made && f.made->role == graph::Role::Adjoint ? f.made->of : "";
}

// How messages name a Func: an adjoint by the Func of the program.
std::string named(const FuncContents& f) {
  const std::string of = adjoint_of(f);
  return of.empty() ? quoted(f.name) : "the adjoint of " + quoted(of);
}

}  // namespace

std::string consumers_of(const Program& program, const LoopedFunc& f) {
  std::string names;
  for (const LoopedFunc& other : program.funcs) {
    for (const FuncPtr& callee : direct_callees(*other.func)) {
      if (callee == f.func) names += (names.empty() ? "" : ", ") + named(*other.func);
    }
  }
  return names.empty() ? named(*f.func) : names;
}

void check_bounded(const Program& program, const LoopedFunc& f, const Box& box) {
  for (size_t d = 0; d < box.size(); d++) {
    if (box[d].is_bounded()) continue;
    const std::string of = adjoint_of(*f.func);
    user_error("compute " + named(*f.func),
               "the region of a Func that its consumers read must be bounded",
               text("dimension ", d, " (", quoted(f.func->args[d]), ") is read without ",
                    box[d].has_lower_bound() ? "an upper" : "a lower", " bound by ",
                    consumers_of(program, f)),
               text("Clamp the index that depends on data",
                    of.empty() ? "" : text(" where the program reads ", quoted(of)),
                    ", as in clamp(index, 0, extent - 1), or promise its range with "
                    "unsafe_promise_clamped"));
  }
}

void check_no_shared_storage(const LoopedFunc& f, const Loop& loop, const std::string& stored) {
  user_error(
      text("store ", quoted(stored), " outside of the parallel loop over ", quoted(loop.var),
           " of ", quoted(f.name())),
      "iterations of a parallel loop must not share the storage of what each of them computes",
      text(quoted(stored), " is computed inside that loop"),
      text("Store ", quoted(stored), " at ", quoted(loop.var),
           " or deeper, or compute it outside of the loop"));
}

namespace {

std::string loops_of(const Program& program, const std::string& func) {
  const LoopedFunc* f = program.find(func);
  if (!f) return text(quoted(func), " has no loops: it is inlined or not part of this pipeline");
  std::string names, host;
  for (const Definition& stage : f->stages) {
    for (const Dim& dim : stage.schedule.dims)
      names += (names.empty() ? "" : ", ") + quoted(dim.var);
    if (stage.schedule.fuse_level.kind == LoopLevel::Kind::At)
      host = stage.schedule.fuse_level.func;
  }
  std::string result = text("the loops of ", quoted(func), " are ", names.empty() ? "none" : names);
  if (!host.empty()) result += text(", of which the outer ones run in the loops of ", quoted(host));
  return result;
}

std::string dimension_of(const LoopedFunc& f, int d) {
  return text("dimension ", d, " (", quoted(f.func->args[d]), ")");
}

}  // namespace

void check_found_its_place(const Program& program, const LoopedFunc& f, bool is_stored) {
  const LoopLevel& asked = is_stored ? f.schedule.store_level : f.schedule.compute_level;
  user_error(
      text(is_stored ? "store " : "compute ", quoted(f.name()), " at ", quoted(asked.var), " of ",
           quoted(asked.func)),
      text("a Func must be ", is_stored ? "stored" : "computed",
           " at a loop that encloses every use of it", is_stored ? " and its compute level" : ""),
      text(loops_of(program, asked.func), ", and ", quoted(f.name()), " is used by ",
           consumers_of(program, f)),
      "Name a loop that encloses all of these uses, or call compute_root()");
}

void check_place_found(const Program& program, const LoopedFunc& f) {
  const LoopLevel& asked = f.schedule.hoist_level;
  user_error(
      text("hoist the storage of ", quoted(f.name()), " to ", quoted(asked.var), " of ",
           quoted(asked.func)),
      "storage is hoisted to a loop that encloses its store level", loops_of(program, asked.func),
      text("Name a loop around the store level of ", quoted(f.name()), ", or drop hoist_storage"));
}

void check_room(const LoopedFunc& f, const Box& room) {
  for (size_t d = 0; d < room.size(); d++) {
    if (room[d].max.defined()) continue;
    user_error(text("hoist the storage of ", quoted(f.name())),
               "the size of hoisted storage is known outside of the loops it is hoisted over",
               text("the extent of its ", dimension_of(f, static_cast<int>(d)), " is not"),
               "Give it with bound_storage, or hoist it less far");
  }
}

void check_storage_of_output(const LoopedFunc& f) {
  for (const StorageRule& rule : f.schedule.storage_rules) {
    if (!rule.fold.defined() && !rule.bound.defined()) continue;
    user_error(text(rule.fold.defined() ? "fold" : "bound", " the storage of ", quoted(f.name()),
                    " in ", quoted(rule.var)),
               "storage that the compiler lays out can be folded or bounded",
               text(quoted(f.name()), " is an output, whose storage is the caller's buffer"),
               "Drop the directive, or give it to a Func that the output reads");
  }
}

Stmt bound_check(const LoopedFunc& f, int d, const Interval& required, const Interval& promised) {
  return run_time_check(
      simplify(promised.min <= required.min && required.max <= promised.max),
      retrograde_error_explicit_bounds_too_small,
      text("cannot compute ", quoted(f.name()), ": its ", dimension_of(f, d), " was bounded to ["),
      promised.min, ", ", promised.max, "], but its consumers need [", required.min, ", ",
      required.max, "]. Bound it to what they read.");
}

Stmt fold_check(const LoopedFunc& f, int d, const Expr& touched, const Expr& factor) {
  return run_time_check(
      simplify(touched <= factor), retrograde_error_fold_factor_too_small,
      text("cannot fold the storage of ", quoted(f.name()), ": ", dimension_of(f, d),
           " wraps around after "),
      factor, " coordinates, but ", touched,
      " of them are alive at once. Fold by at least that many, or drop fold_storage.");
}

Stmt storage_check(const LoopedFunc& f, int d, const Expr& needed, const Expr& promised) {
  return run_time_check(simplify(needed <= promised), retrograde_error_storage_bound_too_small,
                        text("cannot store ", quoted(f.name()), ": the storage of its ",
                             dimension_of(f, d), " was bounded to "),
                        promised, " coordinates, but ", needed,
                        " are needed. Pass a larger extent to bound_storage.");
}

}  // namespace retrograde::lower
