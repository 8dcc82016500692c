#include "transform/rewritable_updates.h"

#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::transform {

namespace {

bool has_effects(const Definition& update) {
  return any_node(update, [](const Call& call) {
    return call.call_type == CallType::Extern ||
           (call.call_type == CallType::Operator && op_info(call.op).cls == OpClass::Effect);
  });
}

}  // namespace

bool RewritableUpdates::contain(const FuncContents& f, const Definition& update, int64_t most) {
  const bool is_part = f.made && (f.made->lanes > 0 || f.made->has_parts || f.made->blocks > 0);
  return !is_part && !f.is_extern() && !has_directives(f) && !point_number(update) &&
         !has_effects(update) && !hosts_.contains(f.name) && read_elsewhere(f, update).defined() &&
         has_few_pure_elements(f, update, most);
}

bool RewritableUpdates::has_few_pure_elements(const FuncContents& f, const Definition& update,
                                              int64_t most) {
  int64_t elements = 1;
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (!is_pure_position(f, update, d)) continue;
    if (!sizes_) sizes_.emplace(outputs_);
    elements *= sizes_->extent(f, d).value_or(most + 1);
  }
  return elements <= most;
}

bool is_long(const Expr& extent, int64_t least) {
  return !can_prove(extent < make_const(extent.type(), least));
}

}  // namespace retrograde::transform
