// check_accesses -- check at run time that each load and store of host code stays inside its storage.
//
// In:  Vector, as code generation gets it. Out: Vector; the same stores. A call fails before the first access outside
//      of its allocation or buffer, and where a promise that the compiler made is false.
//
//   allocate f[int64(n)]:float32 {         let f.last = int64(n) - 1
//     f[i] = g[ramp(j, 1, 8)]        =>    allocate f[int64(n)]:float32 {
//   }                                        assert(0 <= i && i <= f.last, "f is written at i by stage ...")
//                                            f[i] = require(0 <= ramp(j, 1, 8) && ..., g[ramp(j, 1, 8)], "g ...")
//                                          }
//
// Method: the pass runs last, so the checked code equals the code without the pass. A load is checked where its value
//         is computed, under the conditions of the choices around it. Lanes that a predicate masks off may have any
//         index. The body of an Atomic stays unchanged, because its form makes it a single instruction; its checks run
//         before it. A promise is checked where it is a scalar outside of conditions and predicates. The promise of a
//         let is checked where its name is used, inside the choices and loops between the two.
// Not done: kernels, whose accesses the simulated device checks; accesses of extern stages.
// Tests: test/golden/lower/check_accesses/, test/unit/codegen/checked_accesses_test.cpp.
#include "lower/instrumentation/check_accesses.h"

#include <memory>
#include <optional>
#include <unordered_map>

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/checks/run_time_check.h"
#include "lower/nests/copy_statement.h"
#include "retrograde_runtime.h"

namespace retrograde::lower {
namespace {

// The range of valid elements, as int64 offsets from the address of the memory.
struct ElementRange {
  Expr first, last;
};

bool runs_on_device(const Stmt& s) { return s.kind() == Kind::Launch; }

Expr as_int64(const Expr& e) { return cast_to(Int(64, e.type().lanes()), e); }

Expr lanes_like(const Expr& scalar, const Expr& e) {
  return e.type().is_scalar() ? scalar : make_broadcast(scalar, e.type().lanes());
}

// The lowest or highest lane of an index; a masked-off lane counts as `neutral`.
Expr extreme(Kind which, const Expr& index, const Expr& predicate, const Expr& neutral) {
  Expr places = as_int64(index);
  if (predicate.defined()) places = make_select(predicate, places, lanes_like(neutral, places));
  return places.type().is_scalar() ? places : make_vector_reduce(which, places, 1);
}

// ---- where a let is used ----

// Whether evaluating the expression always reads the variable, whatever its conditions and predicates are.
bool is_read(const std::string& name, const Expr& e) {
  bool found = false;
  walk(e, [&](const Expr& part) {
    const auto* variable = part.as<Variable>();
    const auto* load = part.as<Load>();
    const bool may_skip =
        as_op(part, Op::if_then_else) || (load != nullptr && load->predicate.defined());
    found |= variable != nullptr && variable->name == name;
    return !found && !may_skip;
  });
  return found;
}

// Whether running the statement always reads the variable, whatever is chosen and however often its loops run.
bool is_read(const std::string& name, const Stmt& s) {
  const auto in = [&](const auto& part) { return is_read(name, part); };
  return match(
      s, [&](const LetStmt& n) { return in(n.body) || (in(n.value) && is_read(n.name, n.body)); },
      [&](const For& n) { return in(n.min) || in(n.extent); },
      [&](const Store& n) { return !n.predicate.defined() && (in(n.index) || in(n.value)); },
      [&](const IfThenElse&) { return false; },
      [&](const StmtNode&) {
        bool found = false;
        for_each_child(
            s, [&](const Expr& part) { found = found || in(part); },
            [&](const Stmt& part) { found = found || in(part); });
        return found;
      });
}

// State that all parts of the walk share.
struct Surroundings {
  std::unordered_map<std::string, ElementRange> ranges;
  LoopName stage;  // of the innermost loop around
};

class AccessChecker : public Rewriter {
 public:
  explicit AccessChecker(Surroundings& around)
      : around_(around), undecided_(new AccessChecker(around, nullptr)) {}

 protected:
  Expr rewrite(const Expr& e) override {
    if (const auto* call = as_op(e, Op::address_of)) return address(e, *call);
    if (const auto* call = as_op(e, Op::if_then_else)) {
      return call_op(Op::if_then_else, e.type(),
                     {undecided(call->args[0]), (*this)(call->args[1]), (*this)(call->args[2])});
    }
    if (const auto* n = e.as<Select>()) return checked_select(*n);
    if (undecided_ && as_op(e, Op::promise_clamped)) return checked_promise(children(e));
    if (const auto* load = e.as<Load>()) return checked_load(*load);
    return children(e);
  }

  Stmt rewrite(const Stmt& s) override {
    if (runs_on_device(s)) return s;
    return match(
        s, [&](const Allocate& n) { return visit_allocate(s, n); },
        [&](const For& n) { return visit_loop(s, n); },
        [&](const Store& n) {
          const Stmt check = store_check(n);
          AccessChecker& parts = n.predicate.defined() && undecided_ ? *undecided_ : *this;
          return make_block({check, parts.children(s)});
        },
        [&](const LetStmt& n) { return visit_let(n); },
        [&](const IfThenElse& n) { return visit_condition(n); },
        [&](const Atomic& n) {
          return make_block({checks_of(n.body), s});
        },
        [&](const StmtNode&) { return children(s); });
  }

 private:
  Surroundings& around_;
  // The checker for conditions and for operands that a predicate may mask off. Promises hold there only where the
  // surrounding expression says so, so it does not check them. Null in that checker itself.
  const std::unique_ptr<AccessChecker> undecided_;
  std::vector<const LetStmt*>
      unchecked_;  // lets around that contain promises and have not been used yet

  AccessChecker(Surroundings& around, std::nullptr_t) : around_(around) {}
  Expr undecided(const Expr& e) { return undecided_ ? (*undecided_)(e) : (*this)(e); }

  // ---- lets and conditions ----

  Stmt visit_let(const LetStmt& n) {
    const bool promises =
        any_node(n.value, [](const Expr& e) { return as_op(e, Op::promise_clamped) != nullptr; });
    if (!promises || !undecided_) return make_let(n.name, (*this)(n.value), (*this)(n.body));
    const Expr value = undecided(n.value);
    unchecked_.push_back(&n);
    const Stmt body = part(n.body);
    unchecked_.pop_back();
    return make_let(n.name, value, body);
  }

  // Rewrites a statement that runs completely or not at all. The promises of lets that it uses are checked before it.
  Stmt part(const Stmt& s) {
    if (!s.defined() || unchecked_.empty()) return s.defined() ? (*this)(s) : s;
    const std::vector<const LetStmt*> around = unchecked_;
    std::vector<Stmt> stmts;
    std::erase_if(unchecked_, [&](const LetStmt* let) {
      const bool is_used = is_read(let->name, s);
      if (is_used) stmts.push_back(make_evaluate((*this)(let->value)));
      return is_used;
    });
    stmts.push_back((*this)(s));
    unchecked_ = around;
    return make_block(std::move(stmts));
  }

  Stmt visit_condition(const IfThenElse& n) {
    const Expr condition = undecided(n.condition);
    const Stmt when_true = part(n.when_true);
    return with_parts(n, condition, when_true, part(n.when_false));
  }

  // ---- valid ranges ----

  Stmt visit_allocate(const Stmt& s, const Allocate& n) {
    const Expr last = binary(Kind::Sub, n.elements, make_const(Int(64), 1));
    const Expr name = is_const(last) ? last : variable(n.name + ".last", Int(64));
    around_.ranges[n.name] = {make_const(Int(64), 0), name};
    const Stmt result = children(s);
    return is_const(last) ? result : make_let(n.name + ".last", last, result);
  }

  Stmt visit_loop(const Stmt& s, const For& n) {
    const LoopName outer = around_.stage;
    enter(decode_loop_name(n.name));
    const Stmt result = map_children(
        s, [&](const Expr& e) { return (*this)(e); }, [&](const Stmt& body) { return part(body); });
    enter(outer);
    return result;
  }

  // Messages name the stage, so rewritten expressions cannot be reused in another stage.
  void enter(const LoopName& stage) {
    around_.stage = stage;
    forget();
    if (undecided_) undecided_->forget();
  }

  // ---- checks ----

  // "by stage 0 of "f" ", or nothing outside of loops.
  std::string stage(const char* preposition) const {
    const auto& [func, number, var] = around_.stage;
    return func.empty() ? "" : text(preposition, " stage ", number, " of ", quoted(func), " ");
  }

  struct Check {
    Expr holds, error;
  };

  // nullopt for memory whose extent is not known here.
  std::optional<Check> check_of(const std::string& name, const char* access, const Expr& index,
                                const Expr& predicate) const {
    const ElementRange* range = find_or_null(around_.ranges, name);
    if (!range) return {};
    const Expr low = extreme(Kind::Min, index, predicate, range->first);
    const Expr high = extreme(Kind::Max, index, predicate, range->last);
    std::vector<Expr> message = {Expr(int32_t{retrograde_error_access_out_of_bounds}),
                                 Expr(text("checked_accesses: ", quoted(name), " is ", access, " ",
                                           stage("by"), "at element ")),
                                 low};
    if (!index.type().is_scalar()) {
      message.emplace_back(" to ");
      message.push_back(high);
    }
    message.emplace_back(". An access stays inside its storage, which has the elements ");
    message.push_back(range->first);
    message.emplace_back(" to ");
    message.push_back(range->last);
    message.emplace_back(
        ". Correct what unsafe_promise_clamped() or allow_race_conditions() promises; a program "
        "without them "
        "has met a fault of the compiler: report it.");
    const Expr holds =
        binary(Kind::And, binary(Kind::LE, range->first, low), binary(Kind::LE, high, range->last));
    return Check{holds, call_op(Op::error, Int(32), std::move(message))};
  }

  // Both arms are computed, so the loads of both are checked; the promises of an arm hold only if it is chosen.
  Expr checked_select(const Select& n) {
    const auto loads = [](const Expr& arm) {
      return any_node(arm, [](const Load&) { return true; });
    };
    const Expr condition = undecided(n.condition);
    if (loads(n.when_true) || loads(n.when_false))
      return make_select(condition, undecided(n.when_true), undecided(n.when_false));
    const Expr a = (*this)(n.when_true), b = (*this)(n.when_false);
    const bool has_checks = !a.same_as(n.when_true) || !b.same_as(n.when_false);
    return has_checks && condition.type().is_scalar()
               ? call_op(Op::if_then_else, a.type(), {condition, a, b})
               : make_select(condition, a, b);
  }

  Expr checked_load(const Load& n) {
    const Expr predicate = n.predicate.defined() ? undecided(n.predicate) : Expr();
    const Expr index = predicate.defined() ? undecided(n.index) : (*this)(n.index);
    const Expr value = make_load(n.type, n.name, index, predicate, n.symbol);
    const auto check = check_of(n.name, "read", index, predicate);
    if (!check) return value;
    return call_op(Op::require, value.type(), {check->holds, value, check->error});
  }

  Stmt store_check(const Store& n) {
    const Expr predicate = n.predicate.defined() ? undecided(n.predicate) : Expr();
    const Expr index = predicate.defined() ? undecided(n.index) : (*this)(n.index);
    const auto check = check_of(n.name, "written", index, predicate);
    return check ? make_assert(check->holds, check->error) : Stmt();
  }

  // Only the address is needed, so the load itself is not checked.
  Expr address(const Expr& e, const Call& call) {
    const auto* load = call.args[0].as<Load>();
    const Expr index = (*this)(load->index);
    if (index.same_as(load->index)) return e;
    return call_op(Op::address_of, e.type(),
                   {make_load(load->type, load->name, index, load->predicate, load->symbol)});
  }

  // Lanes may be masked off without a visible predicate, so vector promises are not checked; wrong values fail the
  // checks of the accesses that use them.
  Expr checked_promise(const Expr& promise) const {
    if (!promise.type().is_scalar()) return promise;
    const auto* call = promise.as<Call>();
    const Expr &value = call->args[0], &low = call->args[1], &high = call->args[2];
    const Expr error = call_op(
        Op::error, Int(32),
        {Expr(int32_t{retrograde_error_internal}),
         Expr(text("checked_accesses: ", stage("in"), "a coordinate is taken to lie between ")),
         low, Expr(" and "), high, Expr(", which its loops see to, but it is "), value,
         Expr(". This is a fault of the compiler: report the program.")});
    const Expr holds =
        binary(Kind::And, binary(Kind::LE, low, value), binary(Kind::LE, value, high));
    return call_op(Op::require, value.type(), {holds, value, error});
  }

  // The checks for the body of an Atomic, to run before it.
  Stmt checks_of(const Stmt& s) {
    return match(
        s,
        [&](const Store& n) {
          return make_block({store_check(n), make_evaluate((*this)(n.value))});
        },
        [&](const Evaluate& n) { return make_evaluate((*this)(n.value)); },
        [&](const LetStmt& n) { return make_let(n.name, (*this)(n.value), checks_of(n.body)); },
        [&](const IfThenElse& n) {
          return make_if((*this)(n.condition), checks_of(n.when_true),
                         n.when_false.defined() ? checks_of(n.when_false) : Stmt());
        },
        [&](const Block& n) {
          return make_block(mapped(n.stmts, [&](const Stmt& part) { return checks_of(part); }));
        },
        [&](const StmtNode&) { return make_evaluate(0); });
  }
};

// Adds the range from the first to the last element of a buffer, for strides of either sign.
void add_range(const LoweredArgument& arg, Lets& lets,
               std::unordered_map<std::string, ElementRange>& ranges) {
  const Expr buffer = variable(arg.name + ".buffer", Handle()), zero = make_const(Int(64), 0);
  Expr first = zero, last = zero, is_empty = const_false();
  // This code runs before the checks of arguments, so it tests that the buffer is usable.
  const Expr is_usable =
      binary(Kind::EQ, call_op(Op::buffer_dimensions, Int(32), {buffer}), Expr(arg.dimensions));
  const auto if_usable = [&](const Expr& value, int otherwise) {
    const Expr without = make_const(Int(64), otherwise);
    return call_op(Op::if_then_else, Int(64),
                   {call_op(Op::buffer_is_null, Bool(), {buffer}), without,
                    call_op(Op::if_then_else, Int(64), {is_usable, value, without})});
  };
  for (int d = 0; d < arg.dimensions; ++d) {
    const Expr extent = call_op(Op::buffer_extent, Int(32), {buffer, Expr(d)});
    const Expr stride = call_op(Op::buffer_stride, Int(32), {buffer, Expr(d)});
    const Expr reach = binary(
        Kind::Mul, binary(Kind::Sub, as_int64(extent), make_const(Int(64), 1)), as_int64(stride));
    first = binary(Kind::Add, first, binary(Kind::Min, reach, zero));
    last = binary(Kind::Add, last, binary(Kind::Max, reach, zero));
    is_empty = binary(Kind::Or, is_empty, binary(Kind::LE, extent, Expr(0)));
  }
  const std::string first_name = arg.name + ".first", last_name = arg.name + ".last";
  lets.emplace_back(first_name, if_usable(make_select(is_empty, zero, first), 0));
  lets.emplace_back(last_name, if_usable(make_select(is_empty, make_const(Int(64), -1), last), -1));
  ranges[arg.name] = {variable(first_name, Int(64)), variable(last_name, Int(64))};
}

}  // namespace

Stmt check_accesses(const Stmt& s, const std::vector<LoweredArgument>& args) {
  Lets lets;
  std::unordered_map<std::string, ElementRange> ranges;
  for (const LoweredArgument& arg : args) {
    if (arg.is_buffer()) add_range(arg, lets, ranges);
  }
  Surroundings around{std::move(ranges), {}};
  return make_lets(lets, AccessChecker(around)(s));
}

}  // namespace retrograde::lower
