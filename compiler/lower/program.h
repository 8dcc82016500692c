// program.h -- the working copy of a pipeline that lowering starts from.
//
// Compiling never changes users' Funcs. Lowering copies their definitions and schedules here, inlines the Funcs that
// are scheduled inline, and builds loops for the others.
#pragma once

#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "graph/function.h"
#include "ir/build.h"

namespace retrograde::lower {

// The name before it was made unique: "f" for "f.$1", a copy of f. No Func, loop or let has "$" in a name of its own.
std::string original_name(const std::string& name);

// A Func that gets loops. Expressions are DAGs over the names that the user wrote: pure variables, reduction variables,
// parameters.
struct LoopedFunc {
  FuncPtr func;
  FuncPlacement schedule;
  std::vector<Definition> stages;  // pure definition first
  bool is_output = false;

  const std::string& name() const { return func->name; }
  // A Func with updates that is scheduled inline. It has no single value to substitute, so it is computed in the
  // innermost loop of every stage that uses it.
  bool is_computed_innermost() const {
    return schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined;
  }
};

struct Program {
  std::vector<LoopedFunc>
      funcs;  // producers before consumers; pure inlined Funcs have been substituted
  std::unordered_map<std::string, int> index_of;
  // Large expressions of parameters, by the names that stand for them in the definitions (share_parameters).
  Lets shared;

  // Renumbers the Funcs after the order of `funcs` has changed.
  void number() {
    for (size_t f = 0; f < funcs.size(); ++f) index_of[funcs[f].name()] = static_cast<int>(f);
  }
  // The Func of that name, which may be one that make_names_unique has given: "f.$1" is a copy of "f".
  const LoopedFunc* find(const std::string& name) const {
    auto it = index_of.find(original_name(name));
    return it == index_of.end() ? nullptr : &funcs[it->second];
  }
};

// "f" alone, or "f.0", "f.1" ... for Tuples: the buffer that holds value `index` of a Func.
std::string value_buffer_name(const FuncContents& f, int index);

// The text of the program as that of a graph (graph.h), with the definitions as they are now.
std::string to_text(const Program& program);

bool is_stored_where_computed(const LoopedFunc& f);
// Whether the memory of f is allocated further out than its storage level (hoist_storage), and the name of that
// storage.
bool is_hoisted(const LoopedFunc& f);
std::string place_name(const std::string& func);
bool is_place_name(const std::string& name);

// "f.s1.": the prefix of the names of a stage's loops and bounds.
std::string stage_prefix(const std::string& func, int stage);

// Whether the loop of that name runs over a pure variable wherever the schedule has it. Its iterations touch elements
// of their own (the rules for definitions in graph/definitions/define.h).
bool is_pure_loop(const Program& program, const std::string& loop);

}  // namespace retrograde::lower
