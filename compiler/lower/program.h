// program.h -- the working copy of a pipeline that lowering starts from.
//
// Users' Funcs are never changed by compiling them: lowering copies definitions and schedules here,
// inlines what is scheduled inline, and builds loops from what is left.
#pragma once

#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "graph/function.h"

namespace retrograde::lower {

// A Func that gets loops of its own. Expressions are DAGs over the names that the user wrote: pure
// variables, reduction variables, parameters.
struct LoopedFunc {
  FuncPtr func;
  FuncPlacement schedule;
  std::vector<Definition> stages;  // pure definition first
  bool is_output = false;

  const std::string& name() const { return func->name; }
  // A Func with updates whose schedule says inline: it has no single value to substitute, so it is
  // computed in the innermost loop of every stage that uses it.
  bool is_computed_innermost() const {
    return schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined;
  }
};

struct Program {
  std::vector<LoopedFunc> funcs;  // producers before consumers; no pure inlined Func is left
  std::unordered_map<std::string, int> index_of;

  // Where Funcs have other names in the statement than their own, as several copies of one have:
  // by that name, their own.
  std::map<std::string, std::string> renamed;

  const std::string& original(const std::string& name) const {
    auto it = renamed.find(name);
    return it == renamed.end() ? name : it->second;
  }
  // After the order of `funcs` has changed.
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
// Whether the memory of f is allocated further out than it is stored, and the name of its place.
bool is_hoisted(const LoopedFunc& f);
std::string place_name(const std::string& func);
bool is_place_name(const std::string& name);

// "f.s1.": what the names of loops and bounds of a stage begin with.
std::string stage_prefix(const std::string& func, int stage);

}  // namespace retrograde::lower
