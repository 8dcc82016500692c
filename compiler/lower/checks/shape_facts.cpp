#include "lower/checks/shape_facts.h"

namespace retrograde::lower {
namespace {

void name_actual_facts(const LoweredArgument& arg, int d, Substitution& names) {
  const BufferConstraint promised = constraint_of(arg, d);
  // A constant promise stands for the constant, also for a stride that actually differs (see add_constraint_check).
  const auto add = [&](Metadata what, const Expr& promise) {
    if (!promise.defined()) return;
    names[fact_name(arg, what, d)] = is_const(promise) ? promise : actual_fact(arg, what, d);
  };
  add(Metadata::Min, promised.min);
  add(Metadata::Extent, promised.extent);
  add(Metadata::Stride, promised.stride);
}

Substitution actual_facts(const std::vector<LoweredArgument>& args) {
  Substitution names;
  for (const LoweredArgument& arg : args) {
    for (int d = 0; arg.is_buffer() && d < arg.dimensions; d++) name_actual_facts(arg, d, names);
  }
  return names;
}

void add_fact(const LoweredArgument& arg, Metadata what, Op op, int d, const Expr& promised,
              Lets& facts, Lets& promises) {
  std::string name = fact_name(arg, what, d);
  Expr actual = call_op(op, Int(32), {buffer_handle(arg), d});
  facts.emplace_back(promised.defined() ? name + ".actual" : name, actual);
  if (promised.defined()) promises.emplace_back(name, promised);
}

}  // namespace

Expr buffer_handle(const LoweredArgument& arg) { return variable(arg.name + ".buffer", Handle()); }

std::string fact_name(const LoweredArgument& arg, Metadata what, int d) {
  return metadata_name(arg.name, what, static_cast<size_t>(d));
}

Expr fact(const LoweredArgument& arg, Metadata what, int d) {
  return variable(fact_name(arg, what, d));
}

Expr actual_fact(const LoweredArgument& arg, Metadata what, int d) {
  return variable(fact_name(arg, what, d) + ".actual");
}

ShapeFacts::ShapeFacts(const std::vector<LoweredArgument>& args)
    : args_(args), actual_(actual_facts(args)) {}

Lets ShapeFacts::lets() const {
  Lets facts, promises;
  for (const LoweredArgument& arg : args_) {
    if (!arg.is_buffer()) continue;
    for (int d = 0; d < arg.dimensions; d++) {
      BufferConstraint promised = promise_of(arg, d);
      add_fact(arg, Metadata::Min, Op::buffer_min, d, promised.min, facts, promises);
      add_fact(arg, Metadata::Extent, Op::buffer_extent, d, promised.extent, facts, promises);
      add_fact(arg, Metadata::Stride, Op::buffer_stride, d, promised.stride, facts, promises);
    }
  }
  facts.insert(facts.end(), promises.begin(), promises.end());
  return facts;
}

BufferConstraint ShapeFacts::promise_of(const LoweredArgument& arg, int d) const {
  BufferConstraint promised = constraint_of(arg, d);
  for (Expr* side : {&promised.min, &promised.extent, &promised.stride}) {
    if (side->defined()) *side = in_actual_facts(*side);
  }
  return promised;
}

}  // namespace retrograde::lower
