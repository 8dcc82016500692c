// deinterleave_loads -- read neighbouring strided vectors through dense loads that they share.
// In:  Vector.
// Out: Vector; the same stores; a statement reads no element beyond the range that it read before.
//
//   out[..] = in[ramp(b, 2, 8)] + in[ramp(b + 1, 2, 8)]
//   =>
//   out[..] = shuffle(u, v; 0, 2, 4, ...) + shuffle(u, v; 1, 3, 5, ...)
//             with u = in[ramp(b, 1, 8)] and v = in[ramp(b + 8, 1, 8)], the same nodes in both
//
// Method: per statement. Loads of one buffer with stride s and n lanes, whose bases differ by constants, form a
//         family. Loads whose offsets from the lowest base lie between j s and (j + 1) s are picked from the s n
//         elements that start there, if there are at least two of them and the family reads that far. A single load
//         is left to code generation, which reads s vectors for it.
// Not done: sharing between statements; predicated loads.
// Source: folklore. Tests: test/golden/lower/deinterleave_loads/, loop_passes_test.
#include "lower/statement_passes.h"

#include <map>
#include <unordered_map>

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/vectors/strided_loads.h"

namespace retrograde::lower {

namespace {

constexpr int max_stride = 4;

// Families of the loads that every execution of the statement evaluates.
std::vector<StridedFamily> find_families(const Stmt& s) {
  std::vector<StridedFamily> families;
  const auto visit = [&](const Expr& e) {
    const auto load = as_strided(e);
    if (load && load->stride >= 2 && load->stride <= max_stride) add_to_family(*load, families);
    return !as_op(e, Op::if_then_else);
  };
  for_each_child(
      s, [&](const Expr& e) { walk(e, visit); }, [](const Stmt&) {});
  return families;
}

class LoadSharer : public Rewriter {
 protected:
  Expr rewrite(const Expr& e) override {
    const auto found = replacements_.find(e.get());
    return found == replacements_.end() ? children(e) : found->second;
  }

  Stmt rewrite(const Stmt& s) override {
    // Another statement may not be allowed to read the same elements, so no replacement carries over.
    forget();
    replacements_.clear();
    for (const StridedFamily& family : find_families(s)) share(family);
    return children(s);
  }

 private:
  void share(const StridedFamily& family) {
    const int64_t stride = family[0].stride, lanes = family[0].load.type().lanes();
    std::map<int64_t, const StridedLoad*> by_offset;
    for (const StridedLoad& load : family) by_offset.emplace(load.offset, &load);
    const int64_t lowest = by_offset.begin()->first;
    const int64_t last = by_offset.rbegin()->first + stride * (lanes - 1);
    std::map<int64_t, std::vector<const StridedLoad*>> groups;  // by start
    for (const auto& [offset, load] : by_offset) {
      groups[lowest + (offset - lowest) / stride * stride].push_back(load);
    }
    for (const auto& [start, members] : groups) {
      if (members.size() < 2 || start + stride * lanes - 1 > last) continue;
      const std::vector<Expr> whole = dense_loads(*by_offset.begin()->second, start - lowest);
      for (const StridedLoad& load : family) {
        const int64_t first = load.offset - start;
        if (first >= 0 && first < stride) replacements_[load.load.get()] = pick(whole, load, first);
      }
    }
  }

  // Dense loads of stride * lanes elements, starting `distance` after the first element of `lowest`.
  static std::vector<Expr> dense_loads(const StridedLoad& lowest, int64_t distance) {
    const Load& node = lowest.node();
    const int lanes = node.type.lanes();
    std::vector<Expr> result;
    for (int64_t i = 0; i < lowest.stride; ++i) {
      const Type type = lowest.base.type();
      const Expr base = binary(Kind::Add, lowest.base, make_const(type, distance + i * lanes));
      const Expr index = make_ramp(base, make_one(type), lanes);
      result.push_back(make_load(node.type, node.name, index, {}, node.symbol));
    }
    return result;
  }

  static Expr pick(const std::vector<Expr>& whole, const StridedLoad& load, int64_t first) {
    std::vector<int> indices = numbered(
        load.load.type().lanes(), [&](int i) { return static_cast<int>(first + i * load.stride); });
    return make_shuffle(whole, std::move(indices));
  }

  // The keys live as long as the statement that is rewritten.
  std::unordered_map<const ExprNode*, Expr> replacements_;
};

}  // namespace

Stmt deinterleave_loads(const Stmt& s) { return s.defined() ? LoadSharer()(s) : s; }

}  // namespace retrograde::lower
