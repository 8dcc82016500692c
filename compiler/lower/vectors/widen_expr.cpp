// Keeps ramps and broadcasts as long as possible: a load whose index is a ramp is dense.
#include "lower/vectors/widen_expr.h"

#include <numeric>
#include <utility>

#include "diagnostics/error.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

// The vector of which v is `times` repetitions; undefined if there is none.
Expr repeated_part(const Expr& v, int times) {
  const Broadcast* b = v.as<Broadcast>();
  if (!b || v.type().lanes() % times != 0) return {};
  int part_lanes = v.type().lanes() / times;
  if (b->value.type().lanes() == part_lanes) return b->value;
  if (part_lanes % b->value.type().lanes() != 0) return {};
  return make_broadcast(b->value, part_lanes / b->value.type().lanes());
}

// a op b for ramps and broadcasts of integers; undefined when the result is not a ramp.
Expr combine_ramps(Kind kind, const Expr& a, const Expr& b) {
  const Ramp* ra = a.as<Ramp>();
  const Ramp* rb = b.as<Ramp>();
  if (ra && rb) {
    bool adds = kind == Kind::Add || kind == Kind::Sub;
    if (!adds || ra->lanes != rb->lanes || ra->base.type() != rb->base.type()) return {};
    return make_ramp(binary(kind, ra->base, rb->base), binary(kind, ra->stride, rb->stride),
                     ra->lanes);
  }
  if (ra) {
    Expr part = repeated_part(b, ra->lanes);
    if (!part.defined()) return {};
    if (kind == Kind::Add || kind == Kind::Sub)
      return make_ramp(binary(kind, ra->base, part), ra->stride, ra->lanes);
    if (kind == Kind::Mul)
      return make_ramp(binary(kind, ra->base, part), binary(kind, ra->stride, part), ra->lanes);
    return {};
  }
  if (!rb) return {};
  if (kind == Kind::Add || kind == Kind::Mul) return combine_ramps(kind, b, a);
  Expr part = repeated_part(a, rb->lanes);
  if (kind != Kind::Sub || !part.defined()) return {};
  const Expr falling = simplify(binary(Kind::Sub, make_zero(rb->stride.type()), rb->stride));
  return make_ramp(binary(Kind::Sub, part, rb->base), falling, rb->lanes);
}

// (base + s i) / c = base / c + (s / c) i and (base + s i) % c = base % c if c divides s, for every base; undefined
// otherwise.
Expr divide_ramp(Kind kind, const Expr& a, const Expr& b) {
  const Ramp* ramp = a.as<Ramp>();
  const Type type = a.type().element_of();
  if (!ramp || !ramp->base.type().is_scalar() || !type.is_int() || type.bits() < 32) return {};
  const auto stride = as_const_int(ramp->stride), divisor = as_const_int(b);
  if (!stride || !divisor || *divisor <= 0 || *stride % *divisor != 0) return {};
  const Expr first = binary(kind, ramp->base, make_const(type, *divisor));
  return kind == Kind::Mod ? make_broadcast(first, ramp->lanes)
                           : make_ramp(first, make_const(type, *stride / *divisor), ramp->lanes);
}

Expr combine(Kind kind, const Expr& a, const Expr& b) {
  const Broadcast* x = a.as<Broadcast>();
  const Broadcast* y = b.as<Broadcast>();
  if (x && y && x->lanes == y->lanes)
    return make_broadcast(binary(kind, x->value, y->value), x->lanes);
  if (a.type().is_int_or_uint()) {
    const bool divides = kind == Kind::Div || kind == Kind::Mod;
    Expr ramp = divides ? divide_ramp(kind, a, b) : combine_ramps(kind, a, b);
    if (ramp.defined()) return ramp;
  }
  return binary(kind, a, b);
}

Expr conjoin(const Expr& a, const Expr& b) {
  if (!a.defined()) return b;
  return b.defined() ? binary(Kind::And, a, b) : a;
}

Expr counting_ramp(Type type, int lanes) {
  return make_ramp(make_zero(type), make_one(type), lanes);
}

}  // namespace

Expr extract_iteration(const Expr& wide, int iteration, int narrow_lanes) {
  int iterations = wide.type().lanes() / narrow_lanes;
  if (iterations == 1) return wide;
  Expr part = repeated_part(wide, iterations);
  if (part.defined()) return part;
  const Ramp* ramp = wide.as<Ramp>();
  if (ramp && ramp->lanes == iterations) {
    Expr steps = make_const(ramp->stride.type(), iteration);
    return binary(Kind::Add, ramp->base, binary(Kind::Mul, ramp->stride, steps));
  }
  std::vector<int> indices(narrow_lanes);
  std::iota(indices.begin(), indices.end(), iteration * narrow_lanes);
  return make_shuffle({wide}, indices);
}

Expr repeat_each(const Expr& v, int times) {
  if (times == 1) return v;
  const Broadcast* b = v.as<Broadcast>();
  if (b && b->value.type().is_scalar()) return make_broadcast(b->value, b->lanes * times);
  const Ramp* ramp = v.as<Ramp>();
  if (ramp && ramp->base.type().is_scalar()) {
    return make_ramp(make_broadcast(ramp->base, times), make_broadcast(ramp->stride, times),
                     ramp->lanes);
  }
  std::vector<int> indices;
  for (int lane = 0; lane < v.type().lanes(); ++lane) indices.insert(indices.end(), times, lane);
  return make_shuffle({v}, indices);
}

bool has_effects(const Expr& e) {
  return any_node(e, [&](const Call& call) {
    // A trace can be emitted once for a whole vector.
    return op_info(call.op).conduct != Conduct::Silent && !call.is_op(Op::undef) &&
           !call.is_op(Op::trace);
  });
}

Widener::Widener(const std::string& variable, const Expr& min, int iterations, FreshNames& fresh)
    : variable_(variable), iterations_(iterations), fresh_(fresh) {
  bind(variable, make_ramp(min, make_one(min.type()), iterations));
}

Expr Widener::operator()(const Expr& e) {
  if (!e.defined()) return e;
  if (const Variable* v = e.as<Variable>()) return value_or(wide_values_, v->name, e);
  return memo_.get(e, [&] { return widen(e); });
}

Expr Widener::spread(const Expr& e) {
  Expr wide = (*this)(e);
  return wide.same_as(e) ? make_broadcast(e, iterations_) : wide;
}

void Widener::set_mask(const Expr& mask) {
  if (mask.same_as(mask_)) return;
  mask_ = mask;
  memo_.clear();
}

Expr Widener::masked(const Expr& predicate, int narrow_lanes) {
  Expr mask = mask_.defined() ? repeat_each(mask_, narrow_lanes) : Expr();
  return conjoin(predicate.defined() ? spread(predicate) : Expr(), mask);
}

Expr Widener::index_in_wide_allocation(const Expr& index) {
  Type type = index.type();
  Expr scaled = combine(Kind::Mul, spread(index),
                        make_const(type.with_lanes(type.lanes() * iterations_), iterations_));
  return combine(Kind::Add, scaled,
                 repeat_each(counting_ramp(type.element_of(), iterations_), type.lanes()));
}

Expr Widener::widen(const Expr& e) {
  return match(
      e, [&](const Binary& n) { return widen_binary(e, n); },
      [&](const Select& n) { return widen_select(e, n); },
      [&](const Load& n) { return widen_load(e, n); },
      [&](const Ramp& n) { return widen_ramp(e, n); },
      [&](const Broadcast& n) { return widen_broadcast(e, n); },
      [&](const Call& n) { return widen_call(e, n); },
      [&](const Let& n) { return widen_let(e, n); },
      [&](const Shuffle& n) { return widen_shuffle(e, n); },
      [&](const Cast& n) {
        Expr value = (*this)(n.value);
        if (value.same_as(n.value)) return e;
        const Ramp* ramp = value.as<Ramp>();
        bool keeps_ramp = ramp && n.type.is_int() && n.type.bits() >= 32 &&
                          n.value.type().is_int() && n.value.type().bits() >= 32 &&
                          n.type.bits() >= n.value.type().bits();
        if (keeps_ramp) {
          return make_ramp(cast_to(n.type.element_of(), ramp->base),
                           cast_to(n.type.element_of(), ramp->stride), ramp->lanes);
        }
        return cast_to(n.type.with_lanes(value.type().lanes()), value);
      },
      [&](const VectorReduce& n) {
        Expr value = (*this)(n.value);
        return value.same_as(n.value)
                   ? e
                   : make_vector_reduce(n.op, value, n.type.lanes() * iterations_);
      },
      [&](const ExprNode&) {
        return map_children(e, [&](const Expr& child) { return (*this)(child); });
      });
}

Expr Widener::widen_binary(const Expr& e, const Binary& n) {
  Expr a = (*this)(n.a), b = (*this)(n.b);
  if (a.same_as(n.a) && b.same_as(n.b)) return e;
  return combine(e.kind(), spread(n.a), spread(n.b));
}

Expr Widener::widen_select(const Expr& e, const Select& n) {
  Expr c = (*this)(n.condition), t = (*this)(n.when_true), f = (*this)(n.when_false);
  bool condition_varies = !c.same_as(n.condition);
  if (!condition_varies && t.same_as(n.when_true) && f.same_as(n.when_false)) return e;
  int lanes = n.type.lanes();
  bool is_scalar_condition = n.condition.type().is_scalar();
  if (condition_varies) {
    if (is_scalar_condition) c = repeat_each(c, lanes);
  } else if (!is_scalar_condition) {
    c = spread(n.condition);
  }
  return make_select(c, spread(n.when_true), spread(n.when_false));
}

Expr Widener::widen_load(const Expr& e, const Load& n) {
  int lanes = n.type.lanes();
  Type type = n.type.with_lanes(lanes * iterations_);
  if (is_wide_allocation(n.name)) {
    return make_load(type, n.name, index_in_wide_allocation(n.index), masked(n.predicate, lanes),
                     n.symbol);
  }
  Expr index = (*this)(n.index), predicate = (*this)(n.predicate);
  bool varies = !index.same_as(n.index) || !predicate.same_as(n.predicate);
  if (!varies && !may_run_nowhere_) return e;
  return make_load(type, n.name, spread(n.index), masked(n.predicate, lanes), n.symbol);
}

// Lane (iteration, step) is base[iteration] + step * stride[iteration].
Expr Widener::widen_ramp(const Expr& e, const Ramp& n) {
  Expr base = (*this)(n.base), stride = (*this)(n.stride);
  if (base.same_as(n.base) && stride.same_as(n.stride)) return e;
  const Ramp* affine = base.as<Ramp>();
  if (affine && affine->lanes == iterations_ && stride.same_as(n.stride)) {
    return make_ramp(make_ramp(affine->base, n.stride, n.lanes),
                     make_broadcast(affine->stride, n.lanes), iterations_);
  }
  int base_lanes = n.base.type().lanes();
  std::vector<int> blocks;  // the base of every iteration, repeated n.lanes times
  for (int iteration = 0; iteration < iterations_; ++iteration) {
    for (int step = 0; step < n.lanes; ++step) {
      for (int lane = 0; lane < base_lanes; ++lane) blocks.push_back(iteration * base_lanes + lane);
    }
  }
  Type element = n.base.type().element_of();
  Expr steps =
      make_broadcast(repeat_each(counting_ramp(element, n.lanes), base_lanes), iterations_);
  Expr bases = make_shuffle({spread(n.base)}, blocks),
       strides = make_shuffle({spread(n.stride)}, blocks);
  return binary(Kind::Add, bases, binary(Kind::Mul, strides, steps));
}

Expr Widener::widen_broadcast(const Expr& e, const Broadcast& n) {
  Expr value = (*this)(n.value);
  if (value.same_as(n.value)) return e;
  int value_lanes = n.value.type().lanes();
  if (value_lanes == 1) return repeat_each(value, n.lanes);
  std::vector<int> blocks;
  for (int iteration = 0; iteration < iterations_; ++iteration) {
    for (int copy = 0; copy < n.lanes; ++copy) {
      for (int lane = 0; lane < value_lanes; ++lane)
        blocks.push_back(iteration * value_lanes + lane);
    }
  }
  return make_shuffle({value}, blocks);
}

Expr Widener::widen_call(const Expr& e, const Call& n) {
  if (n.is_op(Op::if_then_else)) return widen_branches(e, n);
  bool varies = false;
  for (const Expr& arg : n.args) varies |= !(*this)(arg).same_as(arg);
  if (!varies) return e;
  if (n.call_type == CallType::Extern) return widen_extern(n);
  RETROGRADE_ASSERT(n.call_type == CallType::Operator, "a call of ", n.name,
                    " in the phase FlatStorage");
  // Bounds are known by now, and a ramp says more about the lanes of an index than a promise does.
  const bool promises = n.is_op(Op::promise_clamped, Op::unsafe_promise_clamped);
  if (promises && (*this)(n.args[0]).kind() == Kind::Ramp) return (*this)(n.args[0]);
  std::vector<Expr> args = mapped(n.args, [&](const Expr& arg) { return spread(arg); });
  return call_op(n.op, n.type.with_lanes(n.type.lanes() * iterations_), std::move(args));
}

Expr Widener::under_mask(const Expr& mask, const Expr& e) {
  auto outer_memo = std::exchange(memo_, {});
  Expr outer_mask = std::exchange(mask_, conjoin(mask_, mask));
  bool outer_flag = std::exchange(may_run_nowhere_, true);
  Expr result = spread(e);
  memo_ = std::move(outer_memo);
  mask_ = outer_mask;
  may_run_nowhere_ = outer_flag;
  return result;
}

// If the condition varies, both arms run, each with its loads predicated.
Expr Widener::widen_branches(const Expr& e, const Call& n) {
  Expr c = (*this)(n.args[0]);
  int lanes = n.type.lanes();
  if (!c.same_as(n.args[0])) {
    Expr t = under_mask(c, n.args[1]), f = under_mask(logical_not(c), n.args[2]);
    return make_select(repeat_each(c, lanes), t, f);
  }
  Expr t = (*this)(n.args[1]), f = (*this)(n.args[2]);
  if (t.same_as(n.args[1]) && f.same_as(n.args[2])) return e;
  return call_op(Op::if_then_else, n.type.with_lanes(lanes * iterations_),
                 {c, spread(n.args[1]), spread(n.args[2])});
}

// C functions take scalars, so every lane calls once.
Expr Widener::widen_extern(const Call& n) {
  Lets lets;
  std::vector<Expr> args, results;
  for (const Expr& arg : n.args) {
    Expr wide = spread(arg);
    lets.emplace_back(fresh_(n.name + ".arg"), wide);
    args.push_back(variable(lets.back().first, wide.type()));
  }
  std::vector<int> indices(n.type.lanes() * iterations_);
  std::iota(indices.begin(), indices.end(), 0);
  for (int lane : indices) {
    auto scalars = mapped(args, [&](const Expr& arg) { return extract_iteration(arg, lane, 1); });
    results.push_back(
        call_extern(n.name, n.type.element_of(), std::move(scalars), n.is_pure_extern()));
  }
  return make_lets(lets, make_shuffle(std::move(results), std::move(indices)));
}

// A let under several masks is widened once per mask, each time under another name. The memo keys parts of the body
// by node. A name that does not vary is therefore renamed in the widened body: renaming it first would create new
// nodes for some parts while the memo returns others with the old name.
Expr Widener::widen_let(const Expr& e, const Let& n) {
  Expr value = (*this)(n.value);
  const bool varies = !value.same_as(n.value);
  if (!varies && (*this)(n.body).same_as(n.body)) return e;
  const bool is_first = widened_lets_.insert(n.name).second;
  const std::string name = is_first ? n.name : fresh_(n.name);
  if (varies) bind(n.name, variable(name, value.type()));
  Expr body = (*this)(n.body);
  if (varies) wide_values_.erase(n.name);  // unbound outside of the body
  if (varies && body.same_as(n.body)) return make_broadcast(body, iterations_);
  if (!varies && !is_first) body = substitute(body, n.name, variable(name, value.type()));
  return make_let(name, value, body);
}

Expr Widener::widen_shuffle(const Expr& e, const Shuffle& n) {
  bool varies = false;
  for (const Expr& v : n.vectors) varies |= !(*this)(v).same_as(v);
  if (!varies) return e;
  struct Source {
    int start,
        lanes;  // first lane of the wide vector in the concatenation; lanes of the narrow vector
  };
  std::vector<Source> of_lane;  // by lane of the narrow concatenation
  std::vector<int> lane_in_source;
  std::vector<Expr> vectors;
  int start = 0;
  for (const Expr& v : n.vectors) {
    for (int lane = 0; lane < v.type().lanes(); ++lane) {
      of_lane.push_back({start, v.type().lanes()});
      lane_in_source.push_back(lane);
    }
    vectors.push_back(spread(v));
    start += vectors.back().type().lanes();
  }
  std::vector<int> indices;
  for (int iteration = 0; iteration < iterations_; ++iteration) {
    for (int index : n.indices) {
      indices.push_back(of_lane[index].start + iteration * of_lane[index].lanes +
                        lane_in_source[index]);
    }
  }
  return make_shuffle(std::move(vectors), std::move(indices));
}

}  // namespace retrograde::lower
