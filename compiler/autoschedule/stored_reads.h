// stored_reads.h -- who reads what is stored, directly or through what is computed inline.
#pragma once

#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "graph/function.h"

namespace retrograde::autoschedule {

// All reads of a stored Func by one stage of another.
struct StoredRead {
  FuncPtr reader;
  int stage = 0;
  std::vector<Expr> calls;
};

class StoredReads {
 public:
  // `stored`: Funcs that will be at root, beside those that are computed somewhere already.
  explicit StoredReads(const std::vector<FuncPtr>& outputs,
                       const std::vector<FuncPtr>& stored = {});

  const std::vector<StoredRead>& of(const FuncPtr& f) const;
  // What is read by a copy of a body too many cannot be told.
  bool is_hidden(const FuncPtr& f) const { return hidden_.contains(f.get()); }

 private:
  void note(const FuncPtr& f, int stage, const std::vector<FuncPtr>& stored);
  void add(const FuncPtr& callee, const FuncPtr& reader, int stage, const Expr& call);
  void hide(const FuncPtr& inlined, const std::vector<FuncPtr>& stored);

  std::unordered_map<const Symbol*, std::vector<StoredRead>> reads_;
  std::unordered_set<const Symbol*> hidden_;
};

}  // namespace retrograde::autoschedule
