// only_reader.h -- which Funcs have one stage as their only reader, in whose loops they may be
// computed.
#pragma once

#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "graph/function.h"

namespace retrograde::autoschedule {

// The only stage that reads a Func.
struct Reader {
  FuncPtr func;
  int stage = 0;
  std::vector<const Call*> reads;

  const Definition& definition() const { return func->stage(stage); }
};

class Readers {
 public:
  // `stored`: those that this scheduler has computed at root and given loops.
  Readers(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored);

  // Inside of a Func of which a user has something computed nothing moves, nor does it move itself.
  bool is_inside(const FuncPtr& f) const {
    return stored_.contains(f.get()) && !f->is_extern() && !hosts_.contains(f->name);
  }
  bool is_output(const FuncPtr& f) const { return outputs_.contains(f.get()); }
  std::optional<Reader> only_reader(const FuncPtr& f) const;

 private:
  std::unordered_set<const Symbol*> outputs_, stored_;
  std::unordered_map<const Symbol*, std::vector<FuncPtr>> readers_;
  std::unordered_set<std::string> hosts_;
};

bool is_at_root(const FuncContents& f);
// Of a pure Func of rows: vectors along these, the first dimension, are all that was cut off.
bool has_plain_rows(const FuncContents& f);
// Whether a loop of the stage was split, or comes from a split.
bool is_split(const Definition& stage, const std::string& var);

}  // namespace retrograde::autoschedule
