#include <functional>
#include <set>

#include "autoschedule/moves/edit.h"
#include "ir/lists.h"

namespace retrograde::planning::moves {

void for_each_read(const Plan& plan, const Context& context, StageId stage,
                   ir::FunctionRef<void(const Access&, const MovedIndices&)> visit) {
  std::set<std::pair<FuncId, MovedIndices>> seen;
  const std::function<void(const Access&, const MovedIndices&)> follow =
      [&](const Access& read, const MovedIndices& moved) {
        if (read.of < 0 || read.of == stage.func || !is_inlined(plan, read.of))
          return visit(read, moved);
        if (!seen.emplace(read.of, moved).second) return;
        const StageNode& inlined = context.accesses.stage({read.of, 0});
        for (const Access& own : inlined.reads) {
          follow(own, ir::mapped(own.index, [&](const IndexForm& form) {
                   IteratorSet set = 0;
                   for (size_t i = 0; i < inlined.iterators.size(); ++i) {
                     if (form.moved_by() & set_of(static_cast<int>(i)))
                       set |= moved[static_cast<size_t>(inlined.iterators[i].dimension)];
                   }
                   return set;
                 }));
        }
      };
  for (const Access& read : context.accesses.stage(stage).reads)
    follow(read, ir::mapped(read.index, &IndexForm::moved_by));
}

std::optional<StageId> only_reader(const Plan& plan, const Context& context, FuncId func) {
  std::optional<StageId> only;
  for (const StageId reader : all_readers(plan, context, func)) {
    if (is_inlined(plan, reader.func)) continue;
    if (only) return std::nullopt;
    only = reader;
  }
  return only;
}

}  // namespace retrograde::planning::moves
