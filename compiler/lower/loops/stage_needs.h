// stage_needs.h -- collects the conditions under which Funcs are needed, for needed_stages.
//
// A Func is open between begin() and end(), which are called at its storage. Reads in between add the conditions around
// them, as seen from outside of the storage. The producer of another Func acts as a condition with a placeholder name,
// because not all reads of that Func are known yet; when its storage ends, the name is replaced.
#pragma once

#include <map>
#include <set>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "lower/loops/enclosing_conditions.h"
#include "lower/loops/needed_stages.h"

namespace retrograde::lower {

class StageNeeds {
 public:
  explicit StageNeeds(const EnclosingConditions& enclosing) : enclosing_(enclosing) {}

  // The placeholder for the condition under which the Func is needed.
  static Expr is_needed(const std::string& func);

  bool is_open(const std::string& func) const { return stages_.contains(func); }
  // `complete`: Funcs that are complete here, which the condition may read.
  void begin(const std::string& func, std::set<std::string> complete);
  void add_producer(const std::string& func, const Stmt& producer);
  // A read at the current place. Reads of Funcs that are not open have no effect.
  void add_read(const std::string& func);
  void end(const std::string& func);

  // The result, once all storage has ended.
  StageGuards take_guards() { return std::move(guards_); }

 private:
  struct Stage {
    Depth outside;  // of its storage
    std::set<std::string> complete;
    Expr needed;
    bool is_read = false;
    std::vector<Stmt> producers = {};
    std::set<std::string> mentioned_by = {};  // Funcs further out whose condition mentions this one
  };

  Expr condition_of_read(const Stage& stage) const;
  void note_mentions(const Expr& where, const std::string& func);
  Expr need_outside(const Stage& stage) const;
  void replace_in_outer(const std::string& func, const Expr& need, const Stage& stage);
  void settle(const std::string& func);
  std::unordered_set<std::string> unsettled() const;

  const EnclosingConditions& enclosing_;
  std::map<std::string, Stage> stages_;     // Funcs whose storage is open
  std::map<std::string, Expr> open_needs_;  // of other Funcs; mention unsettled Funcs
  StageGuards guards_;
};

}  // namespace retrograde::lower
