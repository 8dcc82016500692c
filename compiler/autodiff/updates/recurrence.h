// recurrence.h -- adjoints of updates with known index sets: the analysis tells which iteration wrote the value that
// another one reads.
#pragma once

#include <memory>

#include "autodiff/updates/update_context.h"
#include "autodiff/updates/update_relations.h"

namespace retrograde::autodiff {

// Handles the shapes "overwriting" and "recurrence" of update.h: every index is quasi-affine, and no element is written
// twice, unless the update never reads its Func. Returns false and leaves `result` unchanged for any other update.
// Throws if a partial needs an overwritten value that may not be kept.
bool differentiate_recurrence(const UpdateContext& context, UpdateAdjoint& result);

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
