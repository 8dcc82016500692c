// Decides where the storage of every Func of a loop nest is allocated, how large it is, and which dimensions fold.
// There is one object per program: a Func that is computed at several places has a single layout.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "lower/nests/compute_place.h"
#include "lower/nests/emitted.h"
#include "lower/storage/storage_folding.h"

namespace retrograde::lower {

// The loops between the place where f is computed and its storage, innermost first.
std::vector<Loop> loops_to_storage(const LoopedFunc& f, const ComputePlace& site);

class NestStorage {
 public:
  NestStorage(const Program& program, bool folds);

  // Decides which dimensions of f fold. `touched`: the box that the code of the place accesses, in terms of its names.
  Stmt fold(const LoopedFunc& f, const Box& touched, const std::vector<Loop>& loops,
            const std::vector<Slide>& slides, bool is_vectorized, ComputePlace& site, Stmt stmt);
  // Decides how far an async producer may run ahead. `loops`: between f's computation and its storage.
  void note_lead(const LoopedFunc& f, const std::vector<Loop>& loops,
                 const std::vector<Slide>& slides, const Box& touched);

  Stmt realize(const LoopedFunc& f, const Box& box, Stmt stmt);
  // Hoisted storage of f: needs room for the largest region stored at any time.
  void note_place(const LoopedFunc& f, const Box& box, std::map<std::string, Box>& storage) const;

  // Whether any Func is stored at the loop.
  bool is_site(const LoopedFunc& f, const Loop& loop) const;
  // Allocates, around the statement, the Funcs stored at this level, which are in its `storage`.
  Stmt realize_stored(Emitted& code, const std::function<bool(const graph::LoopLevel&)>& is_here);
  // The Func to which an entry of Emitted::storage belongs, also if the entry is its hoisted storage.
  const LoopedFunc* stored_func(const std::string& name) const;

  // The statement with the folds and leads of all Funcs in the layouts of its Realizes.
  Stmt with_layouts(const Stmt& s) const;

 private:
  const Program& program_;
  const bool folds_any_;
  std::set<std::string> sites_;  // "consumer\nloop" of loops at which a Func is stored
  std::map<std::string, std::vector<Fold>> folds_;
  std::map<std::string, int> leads_;  // of async Funcs, see StorageLayout::lead

  void note_folds(const LoopedFunc& f, std::vector<Fold> folds);
};

}  // namespace retrograde::lower
