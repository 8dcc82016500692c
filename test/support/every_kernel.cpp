#include "support/every_kernel.h"

#include <algorithm>
#include <functional>
#include <set>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/operators.h"

namespace retrograde::every_kernel {

namespace {

using namespace ir;

const std::vector<Type> integer_types = {Int(8),  Int(16),  Int(32),  Int(64),
                                         UInt(8), UInt(16), UInt(32), UInt(64)};
const std::vector<Type> float_types = {Float(16), BFloat(16), Float(32), Float(64)};

std::vector<Type> joined(std::vector<Type> a, const std::vector<Type>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}
const std::vector<Type>& number_types() {
  static const std::vector<Type> all = joined(integer_types, float_types);
  return all;
}

const Kind all_kinds[] = {
#define RETROGRADE_EXPR(kind) Kind::kind,
#define RETROGRADE_BINARY(kind) Kind::kind,
#define RETROGRADE_STMT(kind) Kind::kind,
#include "ir/kinds.def"
};

// Whether kernels support a kind or operator.
enum class In { Kernels, HostsAlone, NoCode };

// The body of one kernel, which stores each value at an index of its own.
class Kernel {
 public:
  Kernel(std::string name, int lanes, const std::vector<Type>& types)
      : name_(std::move(name)), lanes_(lanes), types_(types) {}

  In add(Kind kind);
  In add(Op op);
  // Undefined: the kernel stores nothing.
  Stmt launch() const {
    if (stores_.empty()) return {};
    return make_launch(name_, {1, 1, 1}, {32, 1, 1}, most_shared_bytes, make_block(stores_));
  }
  // Adds a kind that only a host supports.
  void add_of_host(Kind kind);
  void add_of_host(Op op);

 private:
  static constexpr int most_shared_bytes = 4096;

  bool takes(Type type) const { return std::ranges::find(types_, type) != types_.end(); }
  std::vector<Type> taken(const std::vector<Type>& among) const {
    std::vector<Type> result;
    std::ranges::copy_if(among, std::back_inserter(result), [&](Type t) { return takes(t); });
    return result;
  }

  Expr thread() const { return variable(thread_index(name_, 0)); }
  // The index of the n-th element that belongs to this thread.
  Expr place(int n, int lanes) const {
    const Expr base = (thread() + 32 * n) * lanes;
    return lanes == 1 ? base : make_ramp(base, 1, lanes);
  }
  Expr place(int n) const { return place(n, lanes_); }
  static std::string memory(const char* which, Type type) {
    return which + std::string("_") + to_string(type.element_of());
  }
  Expr operand(Type type, int n = 0) const {
    return make_load(type.with_lanes(lanes_), memory("in", type), place(n));
  }
  void store(const Expr& value, Stmt (*around)(Stmt) = nullptr) {
    const Type type = value.type();
    Stmt s = make_store(memory("out", type), value, place(count_++, type.lanes()));
    stores_.push_back(around ? around(s) : s);
  }
  void store_all(const std::vector<Type>& types, const std::function<Expr(Type)>& value) {
    for (const Type type : taken(types)) store(value(type));
  }
  Type wide(Type type) const { return type.with_lanes(lanes_); }

  void statement(Kind kind);
  void atomic_updates();
  void reduce_lanes();
  void add_loads();
  void functions_of_floats(Op op);

  const std::string name_;
  const int lanes_;
  const std::vector<Type> types_;
  std::vector<Stmt> stores_;
  int count_ = 0;
};

Type unsigned_form(Type type) { return type.is_int() ? type.with_code(TypeCode::UInt) : type; }

// ---- kinds of nodes ----

void Kernel::add_loads() {
  store_all(types(), [&](Type t) {  // data-dependent indices
    return make_load(wide(t), memory("in", t), operand(Int(32)));
  });
  store_all(types(), [&](Type t) {  // strided
    const Expr base = thread() * (3 * lanes_);
    return make_load(wide(t), memory("in", t), lanes_ == 1 ? base : make_ramp(base, 3, lanes_));
  });
  store_all(types(), [&](Type t) {  // where a condition holds
    return make_load(wide(t), memory("in", t), place(1), operand(Bool()));
  });
}

void Kernel::reduce_lanes() {
  for (const Kind op : {Kind::Add, Kind::Mul, Kind::Min, Kind::Max, Kind::And, Kind::Or}) {
    const bool is_logical = op == Kind::And || op == Kind::Or;
    for (int left = 1; left < lanes_; ++left) {
      if (lanes_ % left != 0) continue;
      store_all(is_logical ? std::vector<Type>{Bool()} : number_types(),
                [&](Type t) { return make_vector_reduce(op, operand(t), left); });
    }
  }
}

void Kernel::atomic_updates() {
  const auto update = [&](Type t, const std::function<Expr(Expr, Expr)>& by) {
    if (!takes(t)) return;
    const std::string name = memory("out", t);
    const Expr index = variable("bin");
    const Expr old = make_load(t, name, index);
    const Expr other = make_load(t, memory("in", t), thread() + count_);
    const Stmt s = make_atomic(name, make_store(name, by(old, other), index));
    stores_.push_back(make_let("bin", thread() * 0 + count_++, s));
  };
  for (const Type t : number_types()) {
    for (const Kind kind : {Kind::Add, Kind::Sub, Kind::Mul, Kind::Min, Kind::Max})
      update(t, [&](const Expr& a, const Expr& b) { return binary(kind, a, b); });
  }
  for (const Type t : integer_types) {
    for (const Op op : {Op::bitwise_and, Op::bitwise_or, Op::bitwise_xor})
      update(t, [&](const Expr& a, const Expr& b) { return call_op(op, {a, b}); });
  }
  for (const Kind kind : {Kind::And, Kind::Or})
    update(Bool(), [&](const Expr& a, const Expr& b) { return binary(kind, a, b); });
}

void Kernel::statement(Kind kind) {
  switch (kind) {
    case Kind::LetStmt:
      store_all(types(), [&](Type t) { return operand(t); });
      for (Stmt& s : stores_) s = make_let("named", thread() + 1, s);
      break;
    case Kind::ProducerConsumer:
      store_all(types(), [&](Type t) { return operand(t); });
      for (Stmt& s : stores_) s = make_producer_consumer("f", true, s);
      break;
    case Kind::For:
      for (const Type t : taken(types())) {
        const Expr at =
            lanes_ == 1 ? Expr(variable("turn")) : make_ramp(variable("turn") * lanes_, 1, lanes_);
        stores_.push_back(
            make_for("turn", 0, variable(block_index(name_, 0)) + 5, ForType::Serial,
                     make_store(memory("out", t), make_load(wide(t), memory("in", t), at), at)));
      }
      break;
    case Kind::Store:
      store_all(types(), [&](Type t) { return operand(t); });
      for (const Type t : taken(types())) {
        stores_.push_back(
            make_store(memory("out", t), operand(t), place(count_++), operand(Bool())));
        stores_.push_back(make_store(memory("out", t), operand(t), operand(Int(32))));
      }
      break;
    case Kind::Allocate:
      for (const Type t : taken(types())) {
        for (const MemoryType memory_type : {MemoryType::Stack, MemoryType::GPUShared}) {
          const std::string name =
              text(memory_type == MemoryType::Stack ? "own_" : "shared_", to_string(t));
          const bool is_shared = memory_type == MemoryType::GPUShared;
          const Expr at =
              lanes_ == 1 ? thread() % 4 : make_ramp((thread() % 4) * lanes_, 1, lanes_);
          const Stmt use = make_block(
              {make_store(name, operand(t), at),
               make_store(memory("out", t), make_load(wide(t), name, at), place(count_++))});
          stores_.push_back(make_allocate(name, t, memory_type,
                                          make_const(Int(64), int64_t{4} * lanes_), use,
                                          is_shared ? Expr(0) : Expr()));
        }
      }
      break;
    case Kind::Block:
      for (const Type t : taken(types())) {
        stores_.push_back(
            make_block({make_store(memory("out", t), operand(t), place(count_)),
                        make_store(memory("out", t), operand(t, 1), place(count_ + 1))}));
        count_ += 2;
      }
      break;
    case Kind::IfThenElse:
      for (const Type t : taken(types())) {
        const auto arm = [&] { return make_store(memory("out", t), operand(t), place(count_++)); };
        stores_.push_back(make_if(thread() < 7, arm(), arm()));
      }
      break;
    case Kind::Evaluate:
      for (const Op op : {Op::gpu_barrier, Op::gpu_warp_barrier})
        stores_.push_back(make_evaluate(call_op(op, Int(32), {})));
      break;
    default:
      break;
  }
}

In Kernel::add(Kind kind) {
  // There is no default case, so that a compiler warns about a kind that is added.
  switch (kind) {
    case Kind::IntImm:
    case Kind::UIntImm:
    case Kind::FloatImm: {
      const bool is_float = kind == Kind::FloatImm;
      store_all(is_float ? float_types : joined(integer_types, {Bool()}), [&](Type t) {
        if (t.is_float()) return make_const(wide(t), 0.75);
        return t.is_uint() == (kind == Kind::UIntImm) ? make_const(wide(t), 1) : make_zero(wide(t));
      });
      return In::Kernels;
    }
    case Kind::Variable:
      store(thread());
      return In::Kernels;
    case Kind::Cast:
      for (const Type from : taken(types()))
        store_all(types(), [&](Type to) { return cast_to(wide(to), operand(from)); });
      return In::Kernels;
    case Kind::Reinterpret:
      for (const Type from : taken(types())) {
        for (const Type to : taken(types())) {
          if (from.bits() == to.bits()) store(reinterpret_as(wide(to), operand(from)));
        }
      }
      return In::Kernels;
    case Kind::Add:
    case Kind::Sub:
    case Kind::Mul:
    case Kind::Div:
    case Kind::Mod:
    case Kind::Min:
    case Kind::Max:
      store_all(number_types(), [&](Type t) { return binary(kind, operand(t), operand(t, 1)); });
      return In::Kernels;
    case Kind::EQ:
    case Kind::NE:
    case Kind::LT:
    case Kind::LE:
    case Kind::GT:
    case Kind::GE:
      store_all(types(), [&](Type t) { return binary(kind, operand(t), operand(t, 1)); });
      return In::Kernels;
    case Kind::And:
    case Kind::Or:
      store(binary(kind, operand(Bool()), operand(Bool(), 1)));
      return In::Kernels;
    case Kind::Not:
      store(logical_not(operand(Bool())));
      return In::Kernels;
    case Kind::Select:
      store_all(types(),
                [&](Type t) { return make_select(operand(Bool()), operand(t), operand(t, 1)); });
      store_all(types(),
                [&](Type t) { return make_select(thread() < 3, operand(t), operand(t, 1)); });
      return In::Kernels;
    case Kind::Load:
      add_loads();
      return In::Kernels;
    case Kind::Ramp:
      if (lanes_ > 1) {
        store_all(number_types(), [&](Type t) {
          return make_ramp(make_load(t, memory("in", t), thread()),
                           make_load(t, memory("in", t), thread() + 1), lanes_);
        });
      }
      return In::Kernels;
    case Kind::Broadcast:
      if (lanes_ > 1) {
        store_all(types(), [&](Type t) {
          return make_broadcast(make_load(t, memory("in", t), thread()), lanes_);
        });
      }
      return In::Kernels;
    case Kind::Let:
      store_all(types(), [&](Type t) {
        const Expr named = variable("named_value", wide(t));
        return make_let("named_value", operand(t), make_select(operand(Bool()), named, named));
      });
      return In::Kernels;
    case Kind::Shuffle:
      if (lanes_ > 1) {
        std::vector<int> backwards;
        for (int i = lanes_; i-- > 0;) backwards.push_back(i);
        store_all(types(), [&](Type t) { return make_shuffle({operand(t)}, backwards); });
        store_all(types(), [&](Type t) { return make_shuffle({operand(t)}, {lanes_ - 1}); });
        store_all(types(), [&](Type t) { return make_interleaved({operand(t), operand(t, 1)}); });
      }
      return In::Kernels;
    case Kind::VectorReduce:
      reduce_lanes();
      return In::Kernels;
    case Kind::Atomic:
      atomic_updates();
      return In::Kernels;
    case Kind::LetStmt:
    case Kind::ProducerConsumer:
    case Kind::For:
    case Kind::Store:
    case Kind::Allocate:
    case Kind::Block:
    case Kind::IfThenElse:
    case Kind::Evaluate:
      statement(kind);
      return In::Kernels;
    case Kind::Assert:
      return In::HostsAlone;
    case Kind::StringImm:  // parts of what is printed
    case Kind::Call:       // covered by their operators
    case Kind::Free:       // frees memory that a host allocated
    case Kind::Provide:    // before storage is flat
    case Kind::Realize:
    case Kind::Prefetch:
    case Kind::Fork:    // lowering refuses it in kernels
    case Kind::Launch:  // the validator does
      return In::NoCode;
  }
  internal_error("a kind of node that no kernel was written for");
}

// ---- operators ----

void Kernel::functions_of_floats(Op op) {
  store_all(float_types, [&](Type t) {
    std::vector<Expr> args;
    for (int n = 0; n < op_info(op).arity; ++n) args.push_back(operand(t, n));
    return call_op(op, wide(t), args);
  });
}

// Operators without a case of their own are functions of floats.
In Kernel::add(Op op) {
  const std::vector<Type> with_bool = joined(integer_types, {Bool()});
  const Expr buffer = variable("in_float32.buffer", Handle());
  const auto fact = [&](Type type, std::vector<Expr> args) {
    const Expr value = call_op(op, type, std::move(args));
    store(type.is_handle() ? reinterpret_as(UInt(64), value) : value);
    return In::Kernels;
  };
  switch (op) {
    case Op::bitwise_and:
    case Op::bitwise_or:
    case Op::bitwise_xor:
      store_all(with_bool, [&](Type t) { return call_op(op, {operand(t), operand(t, 1)}); });
      return In::Kernels;
    case Op::bitwise_not:
    case Op::popcount:
    case Op::count_leading_zeros:
    case Op::count_trailing_zeros:
      store_all(with_bool, [&](Type t) { return call_op(op, {operand(t)}); });
      return In::Kernels;
    case Op::shift_left:
    case Op::shift_right:
      for (const Type amount : taken(integer_types)) {
        store_all(integer_types, [&](Type t) {
          return call_op(op, wide(t), {operand(t), operand(amount, 1)});
        });
      }
      return In::Kernels;
    case Op::abs:
      store_all(number_types(),
                [&](Type t) { return call_op(op, wide(unsigned_form(t)), {operand(t)}); });
      return In::Kernels;
    case Op::absd:
      store_all(number_types(), [&](Type t) {
        return call_op(op, wide(unsigned_form(t)), {operand(t), operand(t, 1)});
      });
      return In::Kernels;
    case Op::lerp:
      for (const Type weight : taken({UInt(8), UInt(16), UInt(32), Float(32), Float(64)})) {
        store_all(types(), [&](Type t) {
          const bool fits = t.is_float() || t.bits() <= 32;
          if (!fits) return operand(t);
          return call_op(op, wide(t), {operand(t), operand(t, 1), operand(weight)});
        });
      }
      return In::Kernels;
    case Op::is_nan:
    case Op::is_inf:
    case Op::is_finite:
      for (const Type t : taken(float_types)) store(call_op(op, wide(Bool()), {operand(t)}));
      return In::Kernels;
    case Op::saturating_cast:
      for (const Type from : taken(types())) {
        store_all(types(), [&](Type to) {
          return from == to ? operand(to) : call_op(op, wide(to), {operand(from)});
        });
      }
      return In::Kernels;
    case Op::likely:
    case Op::likely_if_innermost:
    case Op::stop_gradient:
    case Op::strict_float:
      store_all(types(), [&](Type t) { return call_op(op, {operand(t)}); });
      return In::Kernels;
    case Op::promise_clamped:
    case Op::unsafe_promise_clamped:
      store_all(types(), [&](Type t) {
        return call_op(op, {operand(t), operand(t, 1), operand(t, 2)});
      });
      return In::Kernels;
    case Op::memoize_tag:
      store_all(types(), [&](Type t) { return call_op(op, {operand(t), operand(t, 1)}); });
      return In::Kernels;
    case Op::undef:
      store_all(types(), [&](Type t) {
        return make_select(operand(Bool()), operand(t), call_op(op, wide(t), {}));
      });
      return In::Kernels;
    case Op::random:
      store_all({Int(8), UInt(16), Int(32), UInt(32), Float(16), BFloat(16), Float(32), Float(64)},
                [&](Type t) {
                  return call_op(op, wide(t), {operand(Int(32)), Expr(7)});
                });
      return In::Kernels;
    case Op::if_then_else:
      store_all(types(), [&](Type t) {
        return call_op(op, wide(t), {thread() < 3, operand(t), operand(t, 1)});
      });
      return In::Kernels;
    case Op::buffer_host:
      return fact(Handle(), {buffer});
    case Op::buffer_min:
    case Op::buffer_extent:
    case Op::buffer_stride:
      return fact(Int(32), {buffer, 0});
    case Op::buffer_dimensions:
      return fact(Int(32), {buffer});
    case Op::buffer_type:
      return fact(UInt(32), {buffer});
    case Op::buffer_is_null:
    case Op::buffer_is_query:
      return fact(Bool(), {buffer});
    case Op::address_of:
      return fact(Handle(), {make_load(Float(32), "in_float32", thread())});
    case Op::pack:
      return fact(Handle(), {make_load(Float(32), "in_float32", thread())});
    case Op::prefetch:
      store(call_op(op, Int(32),
                    {call_op(Op::address_of, Handle(), {make_load(Float(32), "in_float32", 0)})}));
      return In::Kernels;
    case Op::gpu_barrier:
    case Op::gpu_warp_barrier:
      stores_.push_back(make_evaluate(call_op(op, Int(32), {})));
      return In::Kernels;
    case Op::print:
    case Op::print_when:
    case Op::require:
    case Op::runtime_call:
    case Op::trace:
    case Op::error:
      return In::HostsAlone;
    case Op::buffer_region:  // lowering replaces it
      return In::NoCode;
    default:
      functions_of_floats(op);
      return In::Kernels;
  }
}

// ---- operations that only a host supports ----

void Kernel::add_of_host(Op op) {
  const Expr value = make_load(Float(32), "in_float32", thread()), condition = thread() < 3;
  const auto done = [&](Type type, std::vector<Expr> args) {
    stores_.push_back(make_evaluate(call_op(op, type, std::move(args))));
  };
  switch (op) {
    case Op::print:
      return store(call_op(op, {value, Expr("a value")}));
    case Op::print_when:
      return store(call_op(op, Float(32), {condition, value, Expr("a value")}));
    case Op::require:
      return store(call_op(op, Float(32), {condition, value, Expr("a message")}));
    case Op::runtime_call:
      return done(Int(32), {Expr("retrograde_to_device"), make_zero(UInt(64))});
    case Op::trace:
      return store(call_op(op, Float(32), {value, Expr(0), Expr("f"), Expr(0), Expr(0), thread()}));
    case Op::error:
      return done(Int(32), {Expr(-1), Expr("a message")});
    default:
      internal_error("an operator that devices have");
  }
}

void Kernel::add_of_host(Kind kind) {
  RETROGRADE_ASSERT(kind == Kind::Assert, kind_name(kind), " is a kind of node that devices have");
  stores_.push_back(make_assert(make_load(Bool(), "in_bool", thread()), Expr(-1)));
}

LoweredFunction with_arguments(const std::string& name, Stmt body) {
  LoweredFunction function;
  function.name = name;
  for (const Type t : types()) {
    for (const bool is_output : {false, true}) {
      LoweredArgument argument;
      argument.name = (is_output ? "out_" : "in_") + to_string(t);
      argument.kind =
          is_output ? LoweredArgument::Kind::OutputBuffer : LoweredArgument::Kind::InputBuffer;
      argument.type = t;
      argument.dimensions = 1;
      function.args.push_back(argument);
    }
  }
  function.body = std::move(body);
  return function;
}

// Calls `visit` with the name of each kind and operator, and whether kernels support it.
template <typename Visit>
void for_each_one(int lanes, const std::vector<Type>& types, const Visit& visit) {
  const auto add = [&](const char* name, auto one) {
    Kernel kernel(std::string("k_") + name, lanes, types);
    const In in = kernel.add(one);
    visit(std::string(name), one, in, kernel);
  };
  for (const Kind kind : all_kinds) add(kind_name(kind), kind);
  for (int i = 0; i < op_count; ++i) add(op_info(static_cast<Op>(i)).name, static_cast<Op>(i));
}

}  // namespace

const std::vector<Type>& types() {
  static const std::vector<Type> all = joined(number_types(), {Bool()});
  return all;
}

LoweredFunction of_everything(int lanes, const std::vector<Type>& types) {
  std::vector<Stmt> launches;
  for_each_one(lanes, types, [&](const std::string&, auto, In in, const Kernel& kernel) {
    if (in == In::Kernels) launches.push_back(kernel.launch());
  });
  return with_arguments("everything", make_block(launches));
}

std::vector<LoweredFunction> of_hosts_alone() {
  std::vector<LoweredFunction> functions;
  for_each_one(1, types(), [&](const std::string& name, auto one, In in, const Kernel&) {
    if (in != In::HostsAlone) return;
    Kernel kernel("k_" + name, 1, types());
    kernel.add_of_host(one);
    functions.push_back(with_arguments(name, kernel.launch()));
  });
  return functions;
}

std::vector<std::string> left_out() {
  std::vector<std::string> names;
  for_each_one(4, types(), [&](const std::string& name, auto, In in, const Kernel& kernel) {
    if (in == In::Kernels && !kernel.launch().defined()) names.push_back(name);
  });
  return names;
}

}  // namespace retrograde::every_kernel
