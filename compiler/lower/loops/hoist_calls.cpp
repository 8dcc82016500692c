// hoist_calls -- move calls of pure C functions with loop-invariant arguments out of their loops.
// In:  FlatStorage, before vectorization; names unique; no Unrolled loops.
// Out: the same phase; the same stores in the same order. Only calls that the program made before are made, and
//      less often.
//
//   for (y, 0, h) {                          let f.value = if_then_else(0 < h*w, f(a), 0)
//     for (x, 0, w) {                        for (y, 0, h) {
//       out[y*w + x] = f(a) + g(y)     =>      let g.value = if_then_else(0 < w, g(y), 0)
//     }                                        for (x, 0, w) {
//   }                                            out[y*w + x] = f.value + g.value
//                                          } }
//
// LLVM does not know that such a function is pure and leaves the call in place; a vectorized loop calls it lane by
// lane.
//
// Method: a call moves out of the loops and conditions around it, innermost first, as long as its arguments, these
//         conditions and the extents of the loops are invariant in the next one. It is guarded by all of these
//         conditions and by the loops running at least once. Equal calls at one place are merged.
// Not done: calls in arms of a select; loops with checks, which must run before the calls after them; arguments and
//           conditions that read memory.
// Source: folklore. Tests: test/golden/lower/hoist_calls/, test/unit/lower/extern_stage_test.cpp.
#include "lower/statement_passes.h"

#include <algorithm>
#include <functional>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/memory_reads.h"
#include "ir/node_count.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

template <class Tree>
bool has_pure_calls(const Tree& tree) {
  return any_node(tree, [](const Call& call) { return call.is_pure_extern(); });
}

// Whether the value of the expression depends on its variables only.
bool is_steady(const Expr& e) {
  return !reads_memory(e, MemoryReads::Functions) && !any_node(e, [](const Call& call) {
    return op_info(call.op).cls != OpClass::Pure && !call.is_marker();
  });
}

class CallHoister : public Rewriter {
 public:
  explicit CallHoister(const Stmt& s) : fresh_(s) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (s.as<For>()) return rewrite_loop(s);
    if (const auto* branch = s.as<IfThenElse>()) return rewrite_branch(*branch);
    switch (s.kind()) {
      case Kind::Block:
      case Kind::Store:
      case Kind::Evaluate:
      case Kind::ProducerConsumer:
      case Kind::Allocate:
        return map_children(s, here_, *this);
      default:
        return map_children(s, here_, [&](const Stmt& part) { return inside({s, {}, {}}, part); });
    }
  }

 private:
  struct Hoisted {
    std::string name;
    Expr runs, call;  // the guard and the call
  };
  // A statement around the current one: a loop, let or condition, or one that no call can leave.
  struct Frame {
    Stmt around;
    Expr holds;                   // a condition's
    std::vector<Hoisted> before;  // a loop's: the calls computed before it
  };
  FreshNames fresh_;
  std::vector<Frame> frames_;
  const std::function<Expr(const Expr&)> here_ = [this](const Expr& e) { return hoisted(e); };

  Stmt inside(Frame frame, const Stmt& part) {
    frames_.push_back(std::move(frame));
    Stmt result = (*this)(part);
    frames_.pop_back();
    return result;
  }

  Stmt rewrite_loop(const Stmt& s) {
    Lets before;
    const Stmt loop = map_children(s, here_, [&](const Stmt& body) {
      frames_.push_back({s, {}, {}});
      Stmt result = (*this)(body);
      for (const Hoisted& value : frames_.back().before)
        before.emplace_back(value.name, call_where(value.runs, value.call));
      frames_.pop_back();
      return result;
    });
    return make_lets(before, loop);
  }

  Stmt rewrite_branch(const IfThenElse& branch) {
    const Expr condition = hoisted(branch.condition);
    const auto under = [&](const Expr& holds, const Stmt& part) {
      return part.defined() ? inside({Stmt(&branch), holds, {}}, part) : part;
    };
    const Stmt when_true = under(condition, branch.when_true);
    return with_parts(branch, condition, when_true,
                      under(logical_not(condition), branch.when_false));
  }

  Expr hoisted(const Expr& e) {
    if (frames_.empty() || !has_pure_calls(e)) return e;
    std::unordered_set<std::string> bound_here;
    walk(e, [&](const Let& let) { bound_here.insert(let.name); });
    return ir::rewrite(e, [&](const Expr& part, const auto& recurse) -> Expr {
      if (part.as<Select>() || as_op(part, Op::if_then_else, Op::require, Op::print_when))
        return part;
      const Call* found = part.as<Call>();
      if (!found || !found->is_pure_extern()) return {};
      const Expr call = map_children(part, recurse);
      return uses_any_variable(call, bound_here) ? call : outside(call);
    });
  }

  // The name of the call's value before the outermost loop that it can leave; the call itself if there is none.
  Expr outside(const Expr& call) {
    for (const Expr& arg : call.as<Call>()->args) {
      if (!is_steady(arg)) return call;
    }
    Frame* place = nullptr;
    Hoisted value{"", const_true(), call}, at_place;
    for (auto frame = frames_.rbegin(); frame != frames_.rend(); ++frame) {
      if (!leave(*frame, value)) break;
      if (!frame->around.as<For>()) continue;
      place = &*frame;
      at_place = value;
      if (uses_names(value, frame->before)) break;
    }
    return place ? named(*place, at_place) : call;
  }

  // Expresses the call outside of the frame; false if it has to stay.
  static bool leave(const Frame& frame, Hoisted& value) {
    if (frame.holds.defined()) return run_where(value, frame.holds);
    if (const auto* let = frame.around.as<LetStmt>()) {
      if (!uses(value, let->name)) return true;
      if (!is_steady(let->value)) return false;
      value.runs = substitute(value.runs, let->name, let->value);
      value.call = substitute(value.call, let->name, let->value);
      return is_small(value.runs) && is_small(value.call);
    }
    const auto* loop = frame.around.as<For>();
    if (!loop || uses(value, loop->name) || has_checks(loop->body)) return false;
    return run_where(value, make_zero(loop->extent.type()) < loop->extent);
  }

  static bool run_where(Hoisted& value, const Expr& condition) {
    value.runs = simplify(value.runs && condition);
    const bool can_say = is_const_true(value.runs) || !value.call.type().is_handle();
    return can_say && is_steady(value.runs) && is_small(value.runs);
  }

  static Expr call_where(const Expr& runs, const Expr& call) {
    if (is_const_true(runs)) return call;
    return call_op(Op::if_then_else, call.type(), {runs, call, make_zero(call.type())});
  }

  static bool has_checks(const Stmt& body) {
    return any_node(body, [](const Assert&) { return true; });
  }

  static bool is_small(const Expr& e) { return has_at_most_nodes(e, 100); }

  static bool uses(const Hoisted& value, const std::string& name) {
    return uses_variable(value.runs, name) || uses_variable(value.call, name);
  }
  static bool uses_names(const Hoisted& value, const std::vector<Hoisted>& others) {
    return std::ranges::any_of(others,
                               [&](const Hoisted& other) { return uses(value, other.name); });
  }

  // Adds the call to the place, merged with an equal call if there is one.
  Expr named(Frame& place, Hoisted value) {
    for (Hoisted& known : place.before) {
      if (!equal(known.call, value.call)) continue;
      if (uses_names({"", value.runs, Expr(0)}, place.before)) break;
      known.runs = simplify(known.runs || value.runs);
      return variable(known.name, value.call.type());
    }
    value.name = fresh_(value.call.as<Call>()->name + ".value");
    place.before.push_back(value);
    return variable(value.name, value.call.type());
  }
};

}  // namespace

Stmt hoist_calls(const Stmt& s) { return has_pure_calls(s) ? CallHoister(s)(s) : s; }

}  // namespace retrograde::lower
