// The storage of every Func of a loop nest: where it is allocated, how large, and where it wraps
// around. One for the whole walk: a Func that is computed at several places has one layout.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "lower/nests/compute_place.h"
#include "lower/nests/emitted.h"
#include "lower/nests/storage_folding.h"

namespace retrograde::lower {

// Loops between the site and the storage of f, innermost first.
std::vector<Loop> loops_to_storage(const LoopedFunc& f, const ComputePlace& site);

class NestStorage {
 public:
  NestStorage(const Program& program, bool folds);

  // Decides where f wraps around. `touched`: by the code of the site, in terms of its names.
  Stmt fold(const LoopedFunc& f, const Box& touched, const std::vector<Loop>& loops,
            const std::vector<Slide>& slides, bool is_vectorized, ComputePlace& site, Stmt stmt);
  // Decides how far an async producer may run ahead. `loops`: between f's computation and its storage.
  void note_async_room(const LoopedFunc& f, const std::vector<Loop>& loops,
                       const std::vector<Slide>& slides, const Box& touched);

  Stmt realize(const LoopedFunc& f, const Box& box, Stmt stmt);
  // Storage that lies in a place further out: room for the largest that it is at any time.
  void note_place(const LoopedFunc& f, const Box& box, std::map<std::string, Box>& storage) const;

  // Whether anything is stored at a loop.
  bool is_site(const LoopedFunc& f, const Loop& loop) const;
  // Allocates around the statement what is stored at this level, which it has in `storage`.
  Stmt realize_stored(Emitted& code, const std::function<bool(const graph::LoopLevel&)>& is_here);
  // The Func whose storage an entry of Emitted::storage is, or is the place of.
  const LoopedFunc* stored_func(const std::string& name) const;

  void report(LoopNests& nests) const;

 private:
  const Program& program_;
  const bool folds_any_;
  std::set<std::string> sites_;  // "consumer\nloop" that store something
  std::map<std::string, std::vector<Fold>> folds_;
  std::map<std::string, int> async_room_;

  void note_folds(const LoopedFunc& f, std::vector<Fold> folds);
};

}  // namespace retrograde::lower
