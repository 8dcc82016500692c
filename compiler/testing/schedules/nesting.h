// nesting.h -- the loops of each stage and the level at which each Func is computed, as far as a random schedule has
// decided them: which loops surround a stage, and which of them are legal compute or storage levels.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "testing/random_loops.h"
#include "testing/schedules/program_funcs.h"

namespace retrograde::fuzz {

// A loop, identified by its Func and stage; root: no Func.
struct Level {
  int func = -1, stage = 0;
  std::string name;
  bool operator==(const Level&) const = default;
};

// Where a Func is computed; for At, also the loop.
enum class Where : uint8_t { Inlined, Root, At };
struct Placement {
  Where where = Where::Root;
  Level compute;
  bool stored_outside = false;
  bool in_ring = false;
};

// A Func that shares another Func's loops, from this one outwards.
struct Companion {
  int func = 0, with = 0;
  std::string loop;
};

class Nesting {
 public:
  using Site = std::pair<int, int>;  // a Func and its stage

  explicit Nesting(const ProgramFuncs& funcs);

  // Decided one Func after the other, consumers first.
  std::vector<std::vector<LoopVariants>> loops;  // of each Func and stage
  std::vector<Placement> placements;             // of each Func
  std::optional<Companion> companion;

  bool is_inlined(int f) const { return placements[f].where == Where::Inlined; }
  bool is_shared(int f) const {
    return companion && (companion->func == f || companion->with == f);
  }

  // The stages that use f. An inlined consumer is replaced by its own consumers.
  const std::set<Site>& sites_of(int f) const { return sites_[f]; }
  void find_sites(int f);

  // The loops around a stage, innermost first: its own, then those around the compute level of its Func. Only loops
  // that a level can name.
  std::vector<Level> levels_around(Site site) const;
  bool is_around_all_sites(const Level& level, int f) const;
  // Whether a Func may be computed at the level, in each of the stage's specializations. A loop level names a Func and
  // a loop without a stage, so no other stage may have such a loop.
  bool is_legal_level(const Level& level) const;
  // False if specializations order the loops in different ways.
  bool runs_in_order(const Level& level) const;
  // The weight of f and all Funcs around the level: each enclosing Func is recomputed in every iteration of the next
  // one's loops, and a Func with updates may read its whole input each time.
  int nesting_of(int f, const Level& level) const;

 private:
  std::vector<Level> with_shared_loops(std::vector<Level> levels) const;

  const ProgramFuncs& funcs_;
  std::vector<std::set<Site>> sites_;
};

}  // namespace retrograde::fuzz
