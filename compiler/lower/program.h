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

namespace retrograde::lower {

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

  // Maps names in the statement to the Func's original name where they differ, for example if a Func is copied.
  std::map<std::string, std::string> renamed;

  const std::string& original(const std::string& name) const {
    auto it = renamed.find(name);
    return it == renamed.end() ? name : it->second;
  }
  // Renumbers the Funcs after the order of `funcs` has changed.
  void number() {
    for (size_t f = 0; f < funcs.size(); ++f) index_of[funcs[f].name()] = static_cast<int>(f);
  }
  const LoopedFunc* find(const std::string& name) const {
    auto it = index_of.find(original(name));
    return it == index_of.end() ? nullptr : &funcs[it->second];
  }
};

// "f" alone, or "f.0", "f.1" ... for Tuples: the buffer that holds value `index` of a Func.
std::string value_buffer_name(const FuncContents& f, int index);

bool is_stored_where_computed(const LoopedFunc& f);
// Whether the memory of f is allocated further out than its storage level (hoist_storage), and the name of that
// storage.
bool is_hoisted(const LoopedFunc& f);
std::string place_name(const std::string& func);
bool is_place_name(const std::string& name);

// "f.s1.": the prefix of the names of a stage's loops and bounds.
std::string stage_prefix(const std::string& func, int stage);

}  // namespace retrograde::lower
