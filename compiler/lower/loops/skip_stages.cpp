// skip_stages -- compute a Func only where something reads it.
// In:  Loops; names unique.
// Out: Loops; producers under conditions, the same stores otherwise.
//
//   realize f [..] {                               realize f [..] {
//     produce f { F }                                if (p) { produce f { F } }
//     consume f {                           =>       consume f {
//       for x { out(x) = select(p, f(x), 0) }          for x { out(x) = select(p, f(x), 0) }
//   } }                                            } }
//
// The selects and ifs of the consumers tell where they read it. A condition is used as far as it can be evaluated where
// the storage of f begins. There it may mention parameters, extents of buffers, variables of loops around that
// storage, and elements of images and of complete Funcs. (A C function that a select calls there anyway is
// pure, and is called once for both.) Parts that depend on loops inside count as true. In a choice between Funcs, such
// as select(x < n, a(x), b(x - n)), the range of x decides whether an arm is reached at all, so that concatenations
// skip a part that is not required. A Func that only skipped Funcs read is skipped, too.
//
// The storage is not skipped: both arms of a select may be evaluated, and then one of them reads uninitialised
// values that are not used. An arm of a select is therefore not taken into account if its value has a further
// effect: a coordinate, an argument of a C function, an operand of a promise.
//
// Method: one walk, from outside in, that tracks conditions and binders (loops, lets). A read of f adds the conditions
//         between its storage and the read, as seen from outside of the binders in between. The producer of g acts as a
//         condition with a placeholder name, because not all reads of g are known yet. Where g's storage ends, the
//         name is replaced, also in the conditions of Funcs that were stored inside of it.
// Not done: outputs; async Funcs and Funcs inside the storage of one (producer and consumer wait for each other);
//         Funcs that are computed by or in kernels; Funcs fused with others (compute_with); conditions over the lanes
//         of a vector; a single point whose condition changes from iteration to iteration, where a branch costs more.
// Side effects of a Func are part of its values: traced stores, calls of C functions and lookups of memoized Funcs are
// skipped with it. A traced load, or memory that debug_to_file writes, is a read.
// Source: Halide's tests and documentation describe the behaviour that users see. Tests:
//         test/golden/lower/skip_stages/, test/unit/lower/skip_stages_test.cpp, test/property.
#include "lower/loops/skip_stages.h"

#include <algorithm>
#include <vector>

#include "ir/build.h"
#include "ir/equal.h"
#include "lower/loops/needed_stages.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

// Computes calls of C functions in the condition, and equal calls in `body`, once before both.
Stmt with_calls_shared(const std::string& func, const Expr& condition, Stmt body) {
  std::vector<Expr> calls;
  walk(condition, [&](const Expr& e) {
    const auto* call = e.as<Call>();
    if (!call || call->call_type != CallType::Extern) return true;
    const auto is_known = [&](const Expr& known) { return equal(known, e); };
    if (std::ranges::none_of(calls, is_known)) calls.push_back(e);
    return false;
  });
  for (size_t i = 0; i < calls.size(); i++) {
    const std::string name = text(func, ".asked.", i);
    const Expr value = variable(name, calls[i].type());
    body = rewrite(body, [&](const Expr& e, const auto&) -> Expr {
      const auto* call = e.as<Call>();
      return call && call->call_type == CallType::Extern && equal(e, calls[i]) ? value : Expr();
    });
    body = make_let(name, calls[i], body);
  }
  return body;
}

}  // namespace

Stmt skip_stages(const Stmt& s, FunctionRef<bool(const std::string&)> may_skip) {
  const StageGuards guards = find_stage_guards(s, may_skip);
  if (guards.empty()) return s;
  return rewrite_statements(s, [&](const Stmt& node, auto& all) {
    const Stmt result = all.children(node);
    const auto* producer = node.as<ProducerConsumer>();
    const auto* storage = node.as<Realize>();
    const bool is_producer = producer && producer->produces;
    const auto guard = is_producer ? guards.find(producer->name)
                       : storage   ? guards.find(storage->name)
                                   : guards.end();
    if (guard == guards.end()) return result;
    if (storage) return with_calls_shared(storage->name, guard->second, result);
    return is_const_false(guard->second) ? make_evaluate(0) : make_if(guard->second, result);
  });
}

}  // namespace retrograde::lower
