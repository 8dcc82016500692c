// self_reads.h -- the reads of an updated Func by itself: which value each one sees, whether that value is needed, and
// what the reads contribute to the adjoint.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "autodiff/updates/update_context.h"
#include "autodiff/updates/update_relations.h"

namespace retrograde::autodiff {

struct SelfRead {
  Expr call;
  UpdateRelations::Read relation;
  bool carries_adjoint = false;  // the sweep reaches it
  bool is_needed = false;        // a partial or an index needs its value
};

// Returns nullopt if a read has a data-dependent index.
std::optional<std::vector<SelfRead>> find_self_reads(const UpdateContext& context,
                                                     UpdateRelations& relations);
// Fills in what a sweep of the update's values tells about the reads.
void mark(std::vector<SelfRead>& reads, const UpdateContext& context, const SweepResult& sweep);
// Finds the needed values, for `result.self_values`: each must be the final value or a kept version. Returns false if a
// value is to be recomputed from checkpoints. Throws if a version may not be kept.
bool keep_needed_values(const std::vector<SelfRead>& reads, const UpdateContext& context,
                        const UpdateRelations& relations, UpdateAdjoint& result);

// The iterations that read an element, for reads of new values (`to_new`) or of values from before the stage.
Inversion inverted(const UpdateContext& context, const Call& call,
                   const UpdateRelations::Read& relation, bool to_new);
// Contributions of self reads to new values (`to_new`) or to values from before the stage.
std::vector<Contribution> self_contributions(const std::vector<SelfRead>& reads,
                                             const UpdateContext& context, const SweepResult& sweep,
                                             const SelfValues& self_values, bool to_new);

// Whether a later stage may write an element that `read` reads.
bool is_written_later(const UpdateContext& context, const UpdateRelations& relations,
                      const UpdateRelations::Read& read);

// The reads of f by itself whose values are proven to be unchanged when f is complete.
class FinalValues {
 public:
  explicit FinalValues(const UpdateContext& context);
  bool contains(const Expr& read);

 private:
  const UpdateContext& c_;
  std::unique_ptr<UpdateRelations> relations_;  // null: isl gave up
};

}  // namespace retrograde::autodiff
