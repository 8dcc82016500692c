// The values and index forms of a stage's expressions.
#include <algorithm>
#include <bit>

#include "autoschedule/access/stage_reader.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::planning {

namespace {

// Pure iterators have any value: their extents are for SizeModel to say.
analysis::Scope<Interval> scope_of(const std::vector<Iterator>& iterators) {
  analysis::Scope<Interval> scope;
  for (const Iterator& i : iterators) {
    const bool is_known = i.kind == Iterator::Kind::Reduction;
    scope.push(i.name, is_known ? Interval{i.min, simplify(i.min + i.extent - 1)} : Interval());
  }
  return scope;
}

uint64_t word_of(Type type) {
  return static_cast<uint64_t>(type.code()) << 32 | static_cast<uint64_t>(type.bits()) << 16 |
         static_cast<uint64_t>(type.lanes());
}

bool has_own_identity(const Call& call) {
  if (call.call_type == CallType::Extern) return !call.is_pure_extern();
  if (call.call_type != CallType::Operator) return false;
  return op_info(call.op).cls == OpClass::Effect || op_info(call.op).conduct != Conduct::Silent;
}

}  // namespace

bool is_likely(const Expr& e) {
  const auto* call = e.as<Call>();
  if (call && call->call_type == CallType::Operator)
    return call->is_likely() || (call->is_marker() && is_likely(call->args[0]));
  if (e.kind() != Kind::Min && e.kind() != Kind::Max) return false;
  const auto* binary = e.as<Binary>();
  return is_likely(binary->a) || is_likely(binary->b);
}

StageValues::StageValues(Names names, ValueNumbers& numbers, const std::vector<Iterator>& iterators)
    : names_(names), numbers_(numbers), scope_(scope_of(iterators)), bounds_(scope_, nullptr) {
  for (size_t i = 0; i < iterators.size(); ++i)
    iterators_.emplace(iterators[i].name, static_cast<int>(i));
}

// ---- values ----

Value StageValues::value(const Expr& e) {
  return values_.get(e, [&] { return ++nodes_, find_value(e, &StageValues::value); });
}

Value StageValues::place(const Expr& e) {
  return places_.get(e, [&] { return ++nodes_, find_place(e); });
}

Value StageValues::find_place(const Expr& e) {
  const IndexForm form = is_index_type(e.type()) ? this->form(e) : IndexForm();
  const bool is_sum =
      !form.is_constant() && (form.opaque.empty() || !form.opaque[0].expr.same_as(e));
  if (!is_sum) return find_value(e, &StageValues::place);
  return value_of(form, numbers_, [&](const OpaqueTerm& term) { return place(term.expr); });
}

// `part` gives the values of the operands.
Value StageValues::find_value(const Expr& e, Part part) {
  ValueNumbers::Words what{static_cast<uint64_t>(e.kind()), word_of(e.type())};
  if (const auto* v = e.as<Variable>()) {
    const auto* iterator = ir::find_or_null(iterators_, v->name);
    if (iterator) return ValueNumbers::iterator(*iterator);
    what.push_back(numbers_.word_of(v->name));
    return numbers_.combine(std::move(what), {});
  }
  if (const auto* call = e.as<Call>()) return call_value(*call, part);
  if (const auto* n = e.as<IntImm>()) what.push_back(static_cast<uint64_t>(n->value));
  if (const auto* n = e.as<UIntImm>()) what.push_back(n->value);
  if (const auto* n = e.as<FloatImm>()) what.push_back(std::bit_cast<uint64_t>(n->value));
  if (const auto* n = e.as<StringImm>()) what.push_back(numbers_.word_of(n->value));
  std::vector<Value> operands;
  for_each_child(e, [&](const Expr& child) { operands.push_back((this->*part)(child)); });
  // Operands of the other kinds, which belong to lowered code, don't describe a node completely.
  const bool is_described = e.as<Binary>() || e.as<Select>() || e.as<Not>() || e.as<Cast>() ||
                            e.as<Reinterpret>() || operands.empty();
  if (!is_described) what.push_back(numbers_.fresh());
  return numbers_.combine(std::move(what), pointers_to(operands));
}

Value StageValues::call_value(const Call& call, Part part) {
  if (call.call_type == CallType::Operator && call.is_marker()) return (this->*part)(call.args[0]);
  ValueNumbers::Words what{static_cast<uint64_t>(Kind::Call), word_of(call.type),
                           static_cast<uint64_t>(call.call_type),
                           static_cast<uint64_t>(call.component)};
  bool from_data = true;
  if (call.call_type == CallType::Func) {
    what.push_back(numbers_.word_of(call.name));  // which later graphs have, too
  } else if (call.call_type == CallType::Image) {
    what.push_back(reinterpret_cast<uint64_t>(call.symbol.raw()));
  } else {
    what.push_back(numbers_.word_of(call.name));
    from_data = call.call_type == CallType::Extern;
  }
  if (has_own_identity(call)) what.push_back(numbers_.fresh());
  std::vector<Value> operands;
  for (const Expr& arg : call.args) operands.push_back((this->*part)(arg));
  Value result = numbers_.combine(std::move(what), pointers_to(operands));
  result.from_data |= from_data;
  return result;
}

// ---- index forms ----

IndexForm StageValues::index(const Expr& e) {
  IndexForm result = form(e);
  if (result.clamped || !result.is_affine()) result.within = bounds_.bounds(e);
  if (!result.is_affine()) result.expr = e;
  return result;
}

IndexForm StageValues::form(const Expr& e) {
  return forms_.get(e, [&] { return ++nodes_, find_form(e); });
}

IndexForm StageValues::opaque(const Expr& e) {
  return opaque_form({value(e), 1, bounds_.bounds(e), e});
}

IndexForm StageValues::find_form(const Expr& e) {
  if (const auto constant = as_const_int(e)) return constant_form(*constant);
  if (const auto* call = e.as<Call>()) {
    const bool is_marker = call->call_type == CallType::Operator && call->is_marker();
    if (!is_marker) return opaque(e);
    const IndexForm inner = form(call->args[0]);
    return call->is_likely() ? inner : clamped(inner, e);
  }
  if (!is_index_type(e.type())) return opaque(e);
  if (const auto* v = e.as<Variable>()) {
    const auto* iterator = ir::find_or_null(iterators_, v->name);
    return iterator ? iterator_form(*iterator) : opaque(e);
  }
  if (const auto* cast = e.as<Cast>())
    return is_index_type(cast->value.type()) ? form(cast->value) : opaque(e);
  if (const auto* select = e.as<Select>()) return select_form(*select).value_or(opaque(e));
  const auto* binary = e.as<Binary>();
  if (!binary) return opaque(e);
  if (e.kind() == Kind::Add || e.kind() == Kind::Sub)
    return sum_form(binary->a, binary->b, e.kind() == Kind::Add ? 1 : -1);
  const auto found = binary_form(e, *binary);
  return found ? *found : opaque(e);
}

std::optional<IndexForm> StageValues::binary_form(const Expr& e, const Binary& binary) {
  if (e.kind() == Kind::Min || e.kind() == Kind::Max) return extreme_form(e, binary);
  const auto a = as_const_int(binary.a), b = as_const_int(binary.b);
  if (e.kind() == Kind::Mul && a) return scaled(form(binary.b), *a);
  if (e.kind() == Kind::Mul && b) return scaled(form(binary.a), *b);
  if (e.kind() == Kind::Div && b && *b > 0) return quotient(form(binary.a), *b);
  if (e.kind() == Kind::Mod && b && *b > 0) return remainder(form(binary.a), *b);
  return std::nullopt;
}

// A summand that does not fit beside the other one is opaque.
IndexForm StageValues::sum_form(const Expr& a, const Expr& b, int64_t factor) {
  const IndexForm first = form(a);
  auto second = scaled(form(b), factor);
  if (!second) second = scaled(opaque(b), factor);
  if (const auto sum = plus(first, *second)) return *sum;
  if (const auto sum = plus(first, *scaled(opaque(b), factor))) return *sum;
  const auto sum = plus(opaque(a), *second);
  return sum ? *sum : *plus(opaque(a), *scaled(opaque(b), factor));
}

// The clamp of a single value bounds its range.
IndexForm StageValues::clamped(IndexForm form, const Expr& clamp) {
  form.clamped = true;
  if (!form.terms.empty() || form.opaque.size() != 1 || form.opaque[0].coefficient != 1 ||
      form.divisor != 1 || form.modulus != 0)
    return form;
  const Interval all = bounds_.bounds(clamp);
  Interval& range = form.opaque[0].range;
  const auto moved = [&](const Expr& end, int64_t by) {
    return end.defined() ? simplify(end - make_const(end.type(), by)) : end;
  };
  const Interval inside{moved(all.min, form.high), moved(all.max, form.low)};
  const auto replaces = [](const Expr& known, const Expr& end, int64_t sign) {
    const auto a = known.defined() ? as_const_int(known) : std::nullopt;
    const auto b = end.defined() ? as_const_int(end) : std::nullopt;
    return !known.defined() || (a && b && sign * *b > sign * *a);
  };
  if (replaces(range.min, inside.min, 1)) range.min = inside.min;
  if (replaces(range.max, inside.max, -1)) range.max = inside.max;
  return form;
}

// A clamp to what does not move, or a choice of taps.
std::optional<IndexForm> StageValues::extreme_form(const Expr& e, const Binary& binary) {
  const bool a_moves = !value(binary.a).iterators.empty();
  const bool b_moves = !value(binary.b).iterators.empty();
  if (a_moves != b_moves) return clamped(form(a_moves ? binary.a : binary.b), e);
  const auto taps = hull(form(binary.a), form(binary.b));
  if (!taps || !a_moves) return std::nullopt;
  IndexForm result = *taps;  // min(x + 1, x + 3) is x + 1
  const IndexForm a = form(binary.a), b = form(binary.b);
  result.low = e.kind() == Kind::Min ? std::min(a.low, b.low) : std::max(a.low, b.low);
  result.high = e.kind() == Kind::Min ? std::min(a.high, b.high) : std::max(a.high, b.high);
  return result;
}

// A boundary condition: the arm inside of the border.
std::optional<IndexForm> StageValues::select_form(const Select& select) {
  const bool first = is_likely(select.when_true), second = is_likely(select.when_false);
  if (first == second) return std::nullopt;
  IndexForm result = form(first ? select.when_true : select.when_false);
  result.clamped = result.turned = true;
  return result;
}

}  // namespace retrograde::planning
