// The accesses and operations of one stage.
#include "autoschedule/access/stage_reader.h"

#include <algorithm>

#include "graph/definitions/own_reads.h"
#include "graph/definitions/parameter_contents.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/visit.h"

namespace retrograde::planning {

std::vector<Iterator> iterators_of(const FuncContents& f, const Definition& definition) {
  std::vector<Iterator> result;
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (is_pure_position(f, definition, d))
      result.push_back({f.args[d], Iterator::Kind::Pure, static_cast<int>(d), {}, {}});
  }
  for (const ReductionVariable& r : definition.rvars)
    result.push_back({r.var, Iterator::Kind::Reduction, -1, r.min, r.extent});
  return result;
}

std::vector<Expr> expressions_of(const Definition& definition) {
  std::vector<Expr> result = definition.args;
  ir::append(result, definition.values);
  result.push_back(definition.predicate);
  return result;
}

namespace {

bool is_comparison(Kind kind) { return kind >= Kind::EQ && kind <= Kind::GE; }

// Nodes that compute nothing.
bool is_free(const Expr& e) {
  const auto* call = e.as<Call>();
  if (call)
    return call->call_type != CallType::Extern &&
           (call->call_type != CallType::Operator || call->is_marker());
  return e.as<Variable>() || e.as<IntImm>() || e.as<UIntImm>() || e.as<FloatImm>() ||
         e.as<StringImm>();
}

// Whether no kernel can make the call.
bool needs_host(const Call& call) {
  if (call.call_type == CallType::Extern) return true;
  constexpr Op of_host[] = {Op::print, Op::print_when, Op::require, Op::trace, Op::runtime_call};
  if (std::ranges::any_of(of_host, [&](Op op) { return call.is_op(op); })) return true;
  const auto image = std::dynamic_pointer_cast<graph::ParameterContents>(call.symbol.lock());
  return image && image->trace.loads;
}

// Whether a condition tells border and interior apart.
bool is_about_border(const Expr& e) {
  if (is_likely(e)) return true;
  if (const auto* n = e.as<Not>()) return is_about_border(n->a);
  const auto* binary = e.as<Binary>();
  return binary && e.type().is_bool() && (is_about_border(binary->a) || is_about_border(binary->b));
}

}  // namespace

StageReader::StageReader(Names names, ValueNumbers& numbers, const FuncContents& f, StageId id)
    : names_(names),
      numbers_(numbers),
      f_(f),
      definition_(f.stage(id.stage)),
      id_(id),
      iterators_(iterators_of(f, definition_)),
      values_(names, numbers, iterators_) {
  for (const Expr& arg : definition_.args) args_.push_back(without_lets(arg));
  for (const Expr& value : definition_.values) stored_.push_back(without_lets(value));
  if (definition_.predicate.defined()) stored_.push_back(without_lets(definition_.predicate));
}

StageNode StageReader::read() {
  StageNode node;
  node.id = id_;
  node.write.by = id_;
  node.write.of = id_.func;
  node.write.writes = true;
  node.write.components = (1u << std::min<size_t>(f_.types.size(), 31)) - 1;
  node.write.index = indices(args_);
  node.write.place = place_of(node.write.index);
  if (definition_.predicate.defined()) node.guard = guard_of(stored_.back(), true, values_);
  std::vector<Expr> roots = args_;
  ir::append(roots, stored_);
  for_each_guarded_call(roots, values_, nodes_,
                        [&](const Call& call, const Guard& guard) { read_call(call, guard); });
  node.reads = std::move(reads_);
  node.needs_host = needs_host_;
  node.definition = expressions_of(definition_);
  if (f_.is_extern()) read_extern(node);
  count_operations(node);
  node.iterators = std::move(iterators_);
  return node;
}

std::vector<IndexForm> StageReader::indices(const std::vector<Expr>& args) {
  return ir::mapped(args, [&](const Expr& arg) { return values_.index(arg); });
}

// Constants are no part of a place: the taps around one have the same.
Value StageReader::place_of(const std::vector<IndexForm>& index) {
  ValueNumbers::Words what{place_key};
  std::vector<Value> places;
  for (size_t d = 0; d < index.size(); ++d) {
    for (const OpaqueTerm& term : index[d].opaque) {
      if (!term.value.from_data || !term.expr.defined()) continue;
      what.push_back(d);
      what.push_back(static_cast<uint64_t>(term.coefficient));
      places.push_back(values_.place(term.expr));
    }
  }
  return places.empty() ? Value() : numbers_.combine(std::move(what), pointers_to(places));
}

void StageReader::read_call(const Call& call, const Guard& guard) {
  needs_host_ = needs_host_ || needs_host(call);
  const bool is_access = call.call_type == CallType::Func || call.call_type == CallType::Image;
  if (is_access)
    read_access(call, guard);
  else if (!guard.others.empty())
    in_arms_.insert(&call);
}

void StageReader::read_access(const Call& call, const Guard& guard) {
  Access access;
  access.by = id_;
  if (call.call_type == CallType::Func)
    access.of = names_.funcs.at(call.symbol.raw());
  else
    access.image = names_.images.at(call.symbol.raw());
  access.components = 1u << std::min(call.component, 31);
  access.index = indices(call.args);
  access.guard = guard;
  auto& like = reads_by_hash_[access.place_hash()];
  for (const size_t i : like) {
    Access& known = reads_[i];
    if (!known.same_place(access)) continue;
    known.components |= access.components;
    known.guard = intersection(known.guard, guard);
    return;
  }
  access.place = place_of(access.index);
  like.push_back(reads_.size());
  reads_.push_back(std::move(access));
}

// A C function may read any element of its arguments.
void StageReader::read_extern(StageNode& node) {
  Value anything;
  for (size_t i = 0; i < iterators_.size(); ++i)
    anything.iterators.push_back(static_cast<int16_t>(i));
  anything.from_data = true;
  for (const ExternArgument& argument : f_.extern_definition->args) {
    Access access;
    access.by = id_;
    size_t dimensions = 0;
    if (argument.kind == ExternArgument::Kind::Func) {
      access.of = names_.funcs.at(argument.func.get());
      dimensions = argument.func->args.size();
    } else if (argument.kind == ExternArgument::Kind::Buffer) {
      access.image = names_.images.at(argument.buffer.get());
      dimensions = static_cast<size_t>(argument.buffer->dimensions);
    } else {
      continue;
    }
    for (size_t d = 0; d < dimensions; ++d) {
      anything.number = numbers_.fresh();
      access.index.push_back(opaque_form({anything, 1, {}, {}}));
    }
    access.place = anything;
    node.reads.push_back(std::move(access));
  }
}

// ---- operations ----

void StageReader::count_operations(StageNode& node) {
  for (const Expr& root : stored_) count(root);
  for (const IndexForm& form : node.write.index) {
    for (const OpaqueTerm& term : form.opaque)
      if (term.expr.defined()) count(term.expr);
  }
  std::map<std::tuple<std::string, Type, IteratorSet, bool, IteratorSet>, int> rows;
  for (const auto& [value, one] : counted_)
    ++rows[{one.name, one.type, one.depends, one.in_arm, one.decided_by}];
  for (const auto& [row, count] : rows) {
    const auto& [name, type, depends, in_arm, decided_by] = row;
    node.operations.push_back({name, type, depends, count, in_arm, decided_by});
  }
}

// Loops run without the conditions of borders but for their first and last iterations.
bool StageReader::count_interior(const Expr& e) {
  if (e.type().is_bool() && is_about_border(e)) {
    if (e.kind() == Kind::And) for_each_child(e, [&](const Expr& child) { count(child); });
    return true;
  }
  std::vector<Expr> arms;
  if (const auto* select = e.as<Select>()) {
    arms = {select->when_true, select->when_false};
  } else if (e.kind() == Kind::Min || e.kind() == Kind::Max) {
    arms = {e.as<Binary>()->a, e.as<Binary>()->b};
  } else {
    return false;
  }
  const bool first = is_likely(arms[0]), second = is_likely(arms[1]);
  const bool is_border = e.as<Select>() && is_about_border(e.as<Select>()->condition);
  if (first == second && !is_border) return false;
  if (!second) count(arms[0]);
  if (!first) count(arms[1]);
  return true;
}

// Affine parts of indices are addresses, which loops move along: they count as nothing.
void StageReader::count(const Expr& e) {
  if (!counted_nodes_.insert(e.get()).second) return;
  ++nodes_;
  const auto* call = e.as<Call>();
  if (call && (call->call_type == CallType::Func || call->call_type == CallType::Image)) {
    for (const Expr& arg : call->args) {
      for (const OpaqueTerm& term : values_.form(arg).opaque)
        if (!term.expr.same_as(e)) count(term.expr);
    }
    return;
  }
  if (count_interior(e)) return;
  for_each_child(e, [&](const Expr& child) { count(child); });
  if (is_free(e)) return;
  Expr operand = e;
  if (is_comparison(e.kind())) operand = e.as<Binary>()->a;
  const Value value = values_.value(e);
  const std::string name = call ? call->name : kind_name(e.kind());
  const bool in_arm = in_arms_.contains(e.get());
  IteratorSet decided_by = 0;
  if (const auto* select = e.as<Select>()) {
    const Value condition = values_.value(select->condition);
    if (!condition.from_data) decided_by = condition.depends();
  }
  const auto [known, is_new] = counted_.try_emplace(
      {name, value}, OperationCount{name, operand.type(), value.depends(), 1, in_arm, decided_by});
  known->second.in_arm &= in_arm;
}

}  // namespace retrograde::planning
