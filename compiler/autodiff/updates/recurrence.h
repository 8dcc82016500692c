// Updates whose index sets are known: which iteration wrote what another one reads.
#pragma once

#include <memory>

#include "autodiff/updates/update_context.h"
#include "autodiff/updates/update_relations.h"

namespace retrograde::autodiff {

// Overwriting and recurrences of update.h, where every place is quasi-affine and no element is
// written twice, unless nothing reads it. Returns false, and leaves `result` alone, for any other
// update. Throws when a partial needs a value that was overwritten and may not be kept.
bool differentiate_recurrence(const UpdateContext& context, UpdateAdjoint& result);

// Whether a stage after the context's own may write what `read` reads.
bool is_written_later(const UpdateContext& context, const UpdateRelations& relations,
                      const UpdateRelations::Read& read);

// Reads of f by itself whose value is still there when f is complete: proven, or not contained.
class FinalValues {
 public:
  explicit FinalValues(const UpdateContext& context);
  bool contains(const Expr& read);

 private:
  const UpdateContext& c_;
  std::unique_ptr<UpdateRelations> relations_;  // null: isl gave up
};

}  // namespace retrograde::autodiff
