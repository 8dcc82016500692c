// nest_emitter.h -- the class behind build_loop_nests: emits the stages computed at each place.
//
// build_loop_nests.cpp handles the root and the directives at a loop, emit_compute_place.cpp combines the Funcs of one
// place, emit_stages.cpp emits the loops of their stages, and emit_extern.cpp emits extern stages.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lower/definitions/value_bounds.h"
#include "lower/nests/build_loop_nests.h"
#include "lower/nests/compute_place.h"
#include "lower/nests/emitted.h"
#include "lower/nests/extern_stage.h"
#include "lower/nests/fused_groups.h"
#include "lower/nests/stage_nest.h"
#include "lower/storage/nest_storage.h"

namespace retrograde::lower {

class NestEmitter {
 public:
  NestEmitter(const Program& program, const LoopNestOptions& options);
  Stmt emit();

 private:
  const Program& program_;
  const LoopNestOptions options_;
  const ValueBounds values_;
  NestStorage storage_;
  const std::vector<FusedGroup> groups_;
  std::vector<int> group_of_;          // per Func: index into groups_
  std::vector<int> root_, innermost_;  // indices into program_.funcs, producers first
  std::map<std::pair<std::string, std::string>, std::vector<int>>
      at_;  // (consumer, loop) -> Funcs computed there
  std::map<std::string, Box> outputs_;

  // ---- what is computed and stored at a loop (build_loop_nests.cpp) ----

  void note_site(int index);
  std::vector<int> computed_innermost_in(const LoopedFunc& f) const;
  std::vector<int> children_at(const LoopedFunc& f, int s, const Loop& loop) const;
  // Computes Funcs just outside `code` and inside loops[i]; their bounds are bound around them.
  Emitted emit_children(const std::vector<int>& children, Emitted code, std::vector<Loop>& loops,
                        size_t i, ComputePlace& home);
  Emitted store_here(const LoopedFunc& f, int s, Emitted code, std::vector<Loop>& loops, size_t i,
                     ComputePlace& home);
  void check_parallel(const LoopedFunc& f, const Loop& loop, const Emitted& code) const;
  void check_everything_found_its_place(const Emitted& all) const;

  // ---- one place: Funcs computed just outside `inner` (emit_compute_place.cpp) ----

  // A Func of a group, and how it is computed here.
  struct Member {
    const LoopedFunc* f;
    Box need;  // the region still to be computed, by the stages that have not been emitted yet
    std::vector<Loop> loops;  // between here and its storage
    std::vector<Slide> slides;
    Box required = {};
    Box touched = {};  // accessed storage beyond the computed region
  };

  struct Realized {
    const LoopedFunc* f;
    Box required, allocated;
  };

  // The code of a group at a place:
  //   realize { if (lead) produce f; consume f { the code before } }
  struct Piece {
    Stmt produce;
    int lead = 0;
    std::vector<const LoopedFunc*> funcs;
    std::vector<Realized> realized;
  };

  // How many iterations before the loop's first a Func is needed: by the first and by the last of its consumers.
  struct Wanted {
    int first = 0, last = 0;
  };
  using WantedFuncs = std::map<std::string, Wanted>;

  Emitted emit_place(const std::vector<int>& children, Emitted code, ComputePlace& site);
  Stmt assemble(const std::vector<Piece>& pieces, Stmt stmt, const Emitted& code,
                const ComputePlace& site);
  std::vector<int> needed_of(const FusedGroup& group, const Emitted& code) const;
  Piece emit_piece(const FusedGroup& group, Emitted& code, WantedFuncs& wanted, ComputePlace& site);
  Box take_required(const LoopedFunc& f, Emitted& code, Box& touched, std::vector<Stmt>& checks);
  Wanted slide_together(std::vector<Member>& members, const WantedFuncs& wanted,
                        ComputePlace& site) const;
  Stmt unless_empty(const Member& member, const Stmt& stmt) const;
  void keep(Member& member, Box allocated, Emitted& code, Emitted& generated, Piece& piece,
            ComputePlace& site);
  Box output_box(const LoopedFunc& f, const Box& read);

  // ---- stages (emit_stages.cpp, emit_extern.cpp) ----

  // A stage among those that share loops (compute_with).
  struct NestStage {
    const LoopedFunc* f;
    int stage;
    Domain domain;
    StageNest nest = {};
    std::vector<Expr> shift = {};  // by how much its loop variables exceed those of the first stage
    std::vector<int> guests = {};  // stages that join its loops
  };

  // Emits all stages of the members over the regions that each needs. `storage` of the result holds the boxes that
  // their storage must have.
  Emitted emit_members(const FusedGroup& group, std::vector<Member>& members, ComputePlace& site,
                       std::vector<Stmt> stmts);
  static bool keeps_beside_its_region(const Member& member, size_t dimension, ComputePlace& site);
  static bool keeps_beside_its_regions(const Member& member, ComputePlace& site);
  static std::optional<Domain> counted_points(const NestStage& stage, const Member& member,
                                              ComputePlace& site);
  void leave_overrun(const std::vector<NestStage>& stages, Emitted& code) const;
  static bool is_one_of(const std::vector<NestStage>& stages, const std::string& func);
  void widen_by_own_reads(Member& member, Emitted& code) const;
  Emitted emit_extern(Member& member, const Domain& domain, ComputePlace& site);
  Emitted emit_extern_call(const LoopedFunc& f, const ExternCall& call, ComputePlace& site,
                           Box& computed) const;
  Emitted emit_extern_loops(const LoopedFunc& f, std::vector<Loop>& loops, const Box& slice,
                            const Expr& has_points, ComputePlace& home);
  void ask_wholes(Emitted& code, ComputePlace& root) const;
  Emitted emit_variants(const FusedNest& nest, std::vector<NestStage> stages, ComputePlace& home);
  Emitted emit_nest(const FusedNest& nest, std::vector<NestStage> stages, ComputePlace& home);
  Emitted emit_stage(const FusedNest& nest, std::vector<NestStage>& stages, int index,
                     ComputePlace& home);
};

}  // namespace retrograde::lower
