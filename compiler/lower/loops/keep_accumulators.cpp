// keep_accumulators -- keep the elements that a reduction updates in registers while its loops run.
// In:  Loops; names unique.
// Out: Loops; names unique; the same operations on every element, in the same order.
//
//   for (r, 0, n) {                           realize kept [0, 8] {
//     unrolled for (c, 0, 8) {                  unrolled for (c, 0, 8) { kept(c) = f(x, c) }
//       f(x, c) = f(x, c) + a(x, r) * b(r, c)   for (r, 0, n) {
//     }                                    =>     unrolled for (c, 0, 8) {
//   }                                               kept(c) = kept(c) + a(x, r) * b(r, c)
//                                                 }
//                                               }
//                                               unrolled for (c, 0, 8) { f(x, c) = kept(c) }
//                                             }
//
// If the statement right before initialises the elements, it fills `kept` instead, and f is not accessed until the
// end:
//
//   for (c, 0, 8) { f(x, c) = bias(c) }       realize kept [0, 8] {
//   for (r, 0, n) { ... }                =>     unrolled for (c, 0, 8) { kept(c) = bias(c) }
//                                               for (r, 0, n) { ... }
//
// Why: the storage of f may be as large as an image, with strides known at run time only, and LLVM cannot prove that
//      other accesses do not alias these elements. An array of constant size with constant indices becomes registers.
//
// Method: outermost loop first. A serial loop is followed inwards, through serial loops, lets and conditions, to
//         vectorized and unrolled loops of constant extents over pure variables around a single Provide. Its point
//         must be invariant in the serial loops, and it must read its own Func at this point only. Conditions that
//         are invariant in the serial loops, as those of tails are, also guard the copies. Other conditions guard only
//         the update, so an element may be written back with its old value although the program did not write it.
//         No other parallel chunk writes it, because all parallel loops around are over pure variables.
//         Initial values come from a nest whose loops and conditions correspond one by one to those of the
//         update: then both have the same elements.
// Not done: more elements than registers hold; Funcs that fit into registers as they are.
// Source: scalar replacement (Callahan, Carr and Kennedy, PLDI 1990).
// Tests: test/golden/lower/keep_accumulators/, codegen_idioms_test.
#include "lower/loops/keep_accumulators.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <unordered_set>
#include <vector>

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/loops/kept_start.h"
#include "lower/loops/kept_update.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

// Replaces the elements that an update accumulates into by an array of their own.
class Kept : public Rewriter {
 public:
  Kept(KeptUpdate update, std::string name) : update_(std::move(update)), name_(std::move(name)) {
    for (size_t i = update_.lanes.size(); i-- > 0;)
      args_.push_back(variable(update_.lanes[i]->name));
  }

  // Copies the elements into the array before the loops, and back after them.
  Stmt copy_in() const {
    return in_lanes(make_provide(name_, values_of(update_.provide->name, update_.point), args_));
  }
  Stmt copy_back() const {
    return in_lanes(make_provide(update_.provide->name, values_of(name_, args_), update_.point));
  }

  Stmt around(const Stmt& body) const {
    std::vector<Type> types;
    std::vector<Range> bounds;
    for (const Expr& value : update_.provide->values) types.push_back(value.type());
    for (size_t i = update_.lanes.size(); i-- > 0;)
      bounds.push_back({update_.lanes[i]->min, update_.lanes[i]->extent});
    return make_realize(name_, types, MemoryType::Stack, bounds, body);
  }

 protected:
  Expr rewrite(const Expr& e) override {
    const Call* own = update_.as_own(e);
    return own ? call_func(name_, e.type(), args_, own->component, {}) : children(e);
  }
  Stmt rewrite(const Stmt& s) override {
    if (s.get() != update_.provide) return children(s);
    return make_provide(name_, mapped(update_.provide->values, *this), args_);
  }

 private:
  std::vector<Expr> values_of(const std::string& func, const std::vector<Expr>& args) const {
    std::vector<Expr> values;
    for (const Expr& value : update_.provide->values)
      values.push_back(call_func(func, value.type(), args, static_cast<int>(values.size()), {}));
    return values;
  }

  Stmt in_lanes(Stmt body) const {
    return lower::in_lanes(update_.lanes, update_.conditions, std::move(body));
  }

  KeptUpdate update_;
  std::string name_;
  std::vector<Expr> args_;
};

class KeepAccumulators : public StatementRewriter {
 public:
  KeepAccumulators(const Stmt& s, const std::function<bool(const For&)>& is_pure)
      : is_pure_(is_pure), fresh_(s) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (const auto* realize = s.as<Realize>()) return in_storage(*realize, s);
    if (const auto* block = s.as<Block>()) return in_order(*block);
    const auto* loop = s.as<For>();
    if (!loop) return children(s);
    if (auto update = update_in(*loop)) return kept(s, std::move(*update), {});
    const bool outside = shares_;
    shares_ |= runs_at_once(loop->runs) && !is_pure_(*loop);
    Stmt result = children(s);
    shares_ = outside;
    return result;
  }

 private:
  // Storage that fits registers needs no copy: its accesses become constant indices.
  Stmt in_storage(const Realize& realize, const Stmt& s) {
    int64_t bytes = 0;
    for (const Type& type : realize.types) bytes += type.bytes();
    for (const Range& r : realize.bounds) {
      const int64_t extent = as_const_int(r.extent).value_or(register_file + 1);
      bytes =
          std::min(bytes, register_file + 1) * std::clamp<int64_t>(extent, 0, register_file + 1);
    }
    if (bytes <= register_file) small_.insert(realize.name);
    return children(s);
  }

  std::optional<KeptUpdate> update_in(const For& loop) const {
    if (loop.runs != ForType::Serial || shares_) return std::nullopt;
    auto update = kept_update(loop, is_pure_);
    return update && !small_.contains(update->provide->name) ? std::move(update) : std::nullopt;
  }

  Stmt in_order(const Block& block) {
    std::vector<Stmt> result;
    for (size_t i = 0; i < block.stmts.size(); ++i) {
      const bool has_next = i + 1 < block.stmts.size();
      const Stmt both = has_next ? started(block.stmts[i], block.stmts[i + 1], {}) : Stmt();
      result.push_back(both.defined() ? both : (*this)(block.stmts[i]));
      i += both.defined() ? 1 : 0;
    }
    return make_block(result);
  }

  // The loop of an update inside lets, if the preceding nest initialises its elements; undefined otherwise.
  Stmt started(const Stmt& nest, const Stmt& next, Substitution lets) {
    if (const auto* let = next.as<LetStmt>()) {
      lets[let->name] = substitute(let->value, lets);
      const Stmt body = started(nest, let->body, std::move(lets));
      return body.defined() ? make_let(let->name, let->value, body) : Stmt();
    }
    const auto* loop = next.as<For>();
    auto update = loop && nest.as<For>() ? update_in(*loop) : std::nullopt;
    const auto start = update ? KeptStart::of(*update, lets, nest, is_pure_) : std::nullopt;
    if (!start) return {};
    return kept(next, std::move(*update), [&](const std::string& array, const KeptUpdate& of) {
      return start->filling(nest, array, of);
    });
  }

  using Filling = std::function<Stmt(const std::string& array, const KeptUpdate& update)>;
  // `filling` initialises the array; if empty, the elements are copied from the Func.
  Stmt kept(const Stmt& loop, KeptUpdate update, const Filling& filling) {
    const std::string name = fresh_(update.provide->name + ".kept");
    const Stmt start = filling ? filling(name, update) : Stmt();
    Kept array(std::move(update), name);
    return array.around(
        make_block({start.defined() ? start : copy_statement(array.copy_in(), fresh_), array(loop),
                    copy_statement(array.copy_back(), fresh_)}));
  }

  const std::function<bool(const For&)>& is_pure_;
  FreshNames fresh_;
  bool shares_ = false;  // iterations of a parallel loop around may access the same element
  std::unordered_set<std::string> small_;
};

}  // namespace

Stmt keep_accumulators(const Stmt& s, const std::function<bool(const For&)>& is_pure) {
  return s.defined() ? KeepAccumulators(s, is_pure)(s) : s;
}

}  // namespace retrograde::lower
