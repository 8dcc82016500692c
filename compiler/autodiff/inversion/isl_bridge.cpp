// Converts expressions to isl's affine functions, and conditions to sets.
#include "autodiff/inversion/isl_bridge.h"

#include <isl/ilp.h>
#include <isl/options.h>

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

IslContext::IslContext(unsigned long max_operations) : ctx(isl_ctx_alloc()) {
  isl_options_set_on_error(ctx, ISL_ON_ERROR_CONTINUE);
  isl_ctx_set_max_operations(ctx, max_operations);
}
IslContext::~IslContext() { isl_ctx_free(ctx); }

void throw_if_failed(isl_ctx* ctx) {
  if (isl_ctx_last_error(ctx) != isl_error_none) isl::exception::throw_last_error(isl::ctx(ctx));
}

IslBridge::IslBridge(IslContext& context, std::vector<std::string> dims)
    : ctx_(context.ctx), dims_(std::move(dims)) {
  isl_space* space = isl_space_set_alloc(ctx_, 0, static_cast<unsigned>(dims_.size()));
  universe_ = isl::manage(isl_set_universe(space));
}

IslBridge IslBridge::with_dims(std::vector<std::string> dims) const {
  IslBridge result = *this;
  result.universe_ = isl::manage(
      isl_set_universe(isl_space_set_alloc(ctx_, 0, static_cast<unsigned>(dims.size()))));
  result.dims_ = std::move(dims);
  result.known_.clear();
  return result;
}

isl::pw_aff IslBridge::constant(int64_t value) const {
  return isl::manage(isl_pw_aff_val_on_domain(universe_.copy(), isl_val_int_from_si(ctx_, value)));
}

isl::pw_aff IslBridge::dim(int position) const {
  isl_local_space* space = isl_local_space_from_space(isl_set_get_space(universe_.get()));
  return isl::manage(isl_pw_aff_var_on_domain(space, isl_dim_set, static_cast<unsigned>(position)));
}

isl::pw_aff IslBridge::parameter(const Expr& e) {
  auto [it, is_new] =
      parameter_names_.try_emplace(e, "p" + std::to_string(parameter_names_.size()));
  if (is_new) parameters_[it->second] = e;
  isl_id* id = isl_id_alloc(ctx_, it->second.c_str(), nullptr);
  return isl::manage(isl_pw_aff_param_on_domain_id(universe_.copy(), id));
}

bool IslBridge::mentions_dim(const Expr& e) const {
  return any_node(
      e, [&](const Variable& v) { return std::ranges::find(dims_, v.name) != dims_.end(); });
}

namespace {

// Whether arithmetic of the type wraps modulo a power of two, which that of isl does not.
bool wraps(Type t) { return !t.is_int() || t.bits() < 32; }

// Whether the type is too wide: parameters are converted back as int32, which cannot hold wider data.
bool is_wide(Type t) { return t.bits() > 32 || (t.is_uint() && t.bits() == 32); }
bool has_wide_data(const Expr& e) {
  return any_node(e, [&](const Expr& node) {
    const auto* call = node.as<Call>();
    const bool is_data = node.as<Variable>() || (call && call->call_type != CallType::Operator);
    return is_data && is_wide(node.type());
  });
}

// Whether isl represents numbers of the operands' type.
bool is_followed(const Binary& comparison) {
  const Type t = comparison.a.type();
  if (is_wide(t)) return t.is_int() && !has_wide_data(comparison.a) && !has_wide_data(comparison.b);
  return t.is_int() || t.is_uint();
}

}  // namespace

std::optional<isl::pw_aff> IslBridge::obstacle(const Expr& e) {
  if (!mentions_dim(e) || fixed_.contains(e)) return parameter(e);
  obstacles_.insert(e);
  return std::nullopt;
}

// A condition that isl cannot represent: a parameter, 0 or 1, if its value is known to be fixed.
std::optional<isl::set> IslBridge::opaque(const Expr& e) {
  if (fixed_.contains(e)) return parameter(e).ge_set(constant(1));
  obstacles_.insert(e);
  return std::nullopt;
}

std::optional<isl::pw_aff> IslBridge::binary(const Binary& b, const Expr& e) {
  if (wraps(e.type())) return obstacle(e);
  std::optional<int64_t> divisor = as_const_int(b.b);
  if (b.kind == Kind::Mul) {
    if (!divisor && !as_const_int(b.a)) return obstacle(e);
    auto a = affine(b.a), c = affine(b.b);
    if (!a || !c) return std::nullopt;
    return a->mul(*c);
  }
  if (b.kind == Kind::Div || b.kind == Kind::Mod) {
    if (!divisor || *divisor == 0) return obstacle(e);
    auto a = affine(b.a);
    if (!a) return std::nullopt;
    isl::val magnitude = isl::manage(isl_val_int_from_si(ctx_, std::abs(*divisor)));
    if (b.kind == Kind::Mod) return a->mod(magnitude);
    isl::pw_aff quotient =
        isl::manage(isl_pw_aff_scale_down_val(a->copy(), magnitude.copy())).floor();
    return *divisor > 0 ? quotient : quotient.neg();
  }
  auto a = affine(b.a), c = affine(b.b);
  if (!a || !c) return std::nullopt;
  switch (b.kind) {
    case Kind::Add:
      return a->add(*c);
    case Kind::Sub:
      return a->sub(*c);
    case Kind::Min:
      return coalesced(a->min(*c));
    case Kind::Max:
      return coalesced(a->max(*c));
    default:
      return obstacle(e);
  }
}

// int(abs(a)) and int(absd(a, b)): the unsigned intermediate value is converted back.
std::optional<isl::pw_aff> IslBridge::absolute(const Cast& c) {
  const auto* call = as_op(c.value, Op::abs, Op::absd);
  if (!call) return std::nullopt;
  if (!call->args[0].type().is_int() || call->args[0].type().bits() < 32 || !c.type.is_int())
    return std::nullopt;
  auto a = affine(call->args[0]);
  if (a && call->is_op(Op::absd)) {
    auto b = affine(call->args[1]);
    if (!b) return std::nullopt;
    a = a->sub(*b);
  }
  if (!a) return std::nullopt;
  return coalesced(a->max(a->neg()));
}

// Shifts and masks by constants: multiples, floors and moduli of powers of two.
std::optional<isl::pw_aff> IslBridge::bits(const Call& c, const Expr& e) {
  const bool shifts = c.is_op(Op::shift_left, Op::shift_right);
  if (!(shifts || c.is_op(Op::bitwise_and)) || !e.type().is_int() || e.type().bits() < 32)
    return obstacle(e);
  const std::optional<int64_t> amount = as_const_int(c.args[1]);
  constexpr int64_t largest = int64_t{1} << 30;  // largest power of two in an int32
  if (!amount || *amount < 0 || *amount >= largest || (shifts && *amount > 30)) return obstacle(e);
  const int64_t power = shifts ? int64_t{1} << *amount : *amount + 1;
  if ((power & (power - 1)) != 0) return obstacle(e);
  const Expr factor = make_const(e.type(), power);
  return affine(c.is_op(Op::shift_left)    ? c.args[0] * factor
                : c.is_op(Op::shift_right) ? c.args[0] / factor
                                           : c.args[0] % factor);
}

namespace {

// Whether the call promises the range of a value that isl cannot represent. The parameter that stands for it keeps the
// promise, so that an element at this place has bounds.
bool promises_data(const Call& c) {
  if (!c.is_op(Op::promise_clamped, Op::unsafe_promise_clamped)) return false;
  if (const auto* read = c.args[0].as<Call>()) return read->call_type != CallType::Operator;
  const auto* cast = c.args[0].as<Cast>();
  return cast && (cast->value.type().is_float() || cast->value.type().bits() < 32);
}

}  // namespace

std::optional<isl::pw_aff> IslBridge::affine(const Expr& e) {
  return known_.get(e, [&] { return affine_form(e); });
}

std::optional<isl::pw_aff> IslBridge::affine_form(const Expr& e) {
  if (fixed_.contains(e)) return parameter(e);
  if (auto value = as_const_int(e)) return constant(*value);
  if (e.type().is_float() || e.type().is_bool()) return obstacle(e);
  return match(
      e,
      [&](const Variable& v) -> std::optional<isl::pw_aff> {
        auto it = std::ranges::find(dims_, v.name);
        return it == dims_.end() ? parameter(e) : dim(static_cast<int>(it - dims_.begin()));
      },
      [&](const Binary& b) { return binary(b, e); },
      [&](const Select& s) -> std::optional<isl::pw_aff> {
        auto c = condition(s.condition);
        if (!c) return obstacle(e);
        auto t = affine(s.when_true), f = affine(s.when_false);
        if (!t || !f) return std::nullopt;
        isl::set otherwise = universe_.subtract(*c);
        return coalesced(t->intersect_domain(*c).union_add(f->intersect_domain(otherwise)));
      },
      [&](const Cast& c) -> std::optional<isl::pw_aff> {
        if (auto magnitude = absolute(c)) return magnitude;
        if (c.value.type().is_bool() && c.type.is_int())
          return affine(make_select(c.value, make_one(c.type), make_zero(c.type)));
        bool exact = c.value.type().is_int() && c.type.is_int() && c.value.type().bits() >= 32 &&
                     c.type.bits() >= 32;
        return exact ? affine(c.value) : obstacle(e);
      },
      [&](const Call& c) -> std::optional<isl::pw_aff> {
        if (promises_data(c)) return obstacle(e);
        return c.is_marker() ? affine(c.args[0]) : bits(c, e);
      },
      [&](const ExprNode&) { return obstacle(e); });
}

namespace {

// The number of nodes of the expression as a tree, up to `most`; shared nodes count each time.
int tree_size(const Expr& e, int most) {
  int size = 1;
  for_each_child(e, [&](const Expr& child) {
    if (size < most) size += tree_size(child, most - size);
  });
  return size;
}
// A bound of at least this size mostly has pieces, or nested floors as those of pyramid levels. What isl would derive
// from it is not worth the time.
constexpr int large_bound = 40;

}  // namespace

isl::pw_aff IslBridge::bound(const Expr& e) {
  if (tree_size(e, large_bound) >= large_bound && !mentions_dim(e)) return parameter(e);
  auto result = affine(e);
  if (result && isl_pw_aff_n_piece(result->get()) == 1) return *result;
  return parameter(e);
}

std::vector<isl::set> IslBridge::ranges_of(const std::vector<LoopVariable>& dims) {
  return numbered(dims.size(), [&](size_t i) {
    const isl::pw_aff at = dim(static_cast<int>(i));
    isl::set range = universe_;
    if (dims[i].min.defined()) range = range.intersect(at.ge_set(bound(dims[i].min)));
    if (dims[i].max.defined()) range = range.intersect(at.le_set(bound(dims[i].max)));
    return range;
  });
}

std::optional<isl::set> IslBridge::comparison(const Binary& b, const Expr& e) {
  if (!is_followed(b)) return opaque(e);
  auto a = affine(b.a), c = affine(b.b);
  if (!a || !c) return std::nullopt;
  switch (b.kind) {
    case Kind::EQ:
      return a->eq_set(*c);
    case Kind::NE:
      return a->ne_set(*c);
    case Kind::LT:
      return a->lt_set(*c);
    case Kind::LE:
      return a->le_set(*c);
    case Kind::GT:
      return a->gt_set(*c);
    default:
      return a->ge_set(*c);
  }
}

std::optional<isl::set> IslBridge::condition(const Expr& e) {
  if (is_const_true(e)) return universe_;
  if (is_const_false(e)) return isl::manage(isl_set_empty(isl_set_get_space(universe_.get())));
  if (const auto* n = e.as<Not>()) {
    auto a = condition(n->a);
    if (!a) return std::nullopt;
    return universe_.subtract(*a);
  }
  if (const auto* call = e.as<Call>(); call && call->is_marker()) return condition(call->args[0]);
  const auto* b = e.as<Binary>();
  if (!b) return opaque(e);
  if (b->kind == Kind::And || b->kind == Kind::Or) {
    auto a = condition(b->a), c = condition(b->b);
    if (!a || !c) return std::nullopt;
    return coalesced(b->kind == Kind::And ? a->intersect(*c) : a->unite(*c));
  }
  if (b->kind >= Kind::EQ && b->kind <= Kind::GE) return comparison(*b, e);
  return opaque(e);
}

}  // namespace retrograde::autodiff
