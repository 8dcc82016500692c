// deinterleave_loads -- read neighbouring strided vectors through dense ones that they share.
// In:  Vector.
// Out: Vector; the same stores; no element is read that lies outside of what a statement read.
//
//   out[..] = in[ramp(b, 2, 8)] + in[ramp(b + 1, 2, 8)]
//   =>
//   out[..] = shuffle(u, v; 0, 2, 4, ...) + shuffle(u, v; 1, 3, 5, ...)
//             with u = in[ramp(b, 1, 8)] and v = in[ramp(b + 8, 1, 8)], the same nodes in both
//
// Method: per statement. Loads of one buffer, stride s and n lanes whose bases differ by constants
//         are a family; those whose offsets from the lowest base fall between j s and (j + 1) s are
//         picked from the s n elements that start there, when there are at least two of them and
//         the family reads that far. A load alone is left to code generation, which reads s
//         vectors for it.
// Not done: sharing between statements; predicated loads.
// Source: folklore. Tests: test/golden/lower/deinterleave_loads/, loop_passes_test.
#include "lower/statement_passes.h"

#include <map>
#include <optional>
#include <unordered_map>

#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

constexpr int max_stride = 4;

struct StridedLoad {
  Expr load;
  Expr base;
  int64_t stride;
  int64_t offset = 0;  // from the base of its family
};

std::optional<StridedLoad> as_strided(const Expr& e) {
  const auto* load = e.as<Load>();
  const auto* ramp = load && !load->predicate.defined() ? load->index.as<Ramp>() : nullptr;
  if (!ramp || !ramp->base.type().is_scalar()) return std::nullopt;
  const auto stride = as_const_int(ramp->stride);
  if (!stride || *stride < 2 || *stride > max_stride) return std::nullopt;
  return StridedLoad{e, ramp->base, *stride};
}

// Loads of one buffer with one stride and number of lanes, at constant distances.
struct StridedFamily {
  std::string buffer;
  Type type;
  std::vector<StridedLoad> loads;

  bool takes(StridedLoad& load) const {
    const auto* node = load.load.as<Load>();
    if (node->name != buffer || node->type != type || load.stride != loads[0].stride) return false;
    const auto offset = as_const_int(simplify(binary(Kind::Sub, load.base, loads[0].base)));
    if (!offset) return false;
    load.offset = *offset;
    return true;
  }
};

// What every execution of the statement evaluates.
std::vector<StridedFamily> find_families(const Stmt& s) {
  std::vector<StridedFamily> families;
  const auto visit = [&](const Expr& e) {
    const auto* call = e.as<Call>();
    if (auto load = as_strided(e)) {
      bool is_taken = false;
      for (StridedFamily& family : families) {
        if (is_taken) break;
        is_taken = family.takes(*load);
        if (is_taken) family.loads.push_back(*load);
      }
      if (!is_taken) families.push_back({load->load.as<Load>()->name, load->load.type(), {*load}});
    }
    return !call || !call->is_op(Op::if_then_else);
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
    // What one statement may read another need not: nothing carries over.
    forget();
    replacements_.clear();
    for (const StridedFamily& family : find_families(s)) share(family);
    return children(s);
  }

 private:
  void share(const StridedFamily& family) {
    const int64_t stride = family.loads[0].stride, lanes = family.type.lanes();
    std::map<int64_t, const StridedLoad*> by_offset;
    for (const StridedLoad& load : family.loads) by_offset.emplace(load.offset, &load);
    const int64_t lowest = by_offset.begin()->first;
    const int64_t last = by_offset.rbegin()->first + stride * (lanes - 1);
    std::map<int64_t, std::vector<const StridedLoad*>> groups;  // by start
    for (const auto& [offset, load] : by_offset) {
      groups[lowest + (offset - lowest) / stride * stride].push_back(load);
    }
    for (const auto& [start, members] : groups) {
      if (members.size() < 2 || start + stride * lanes - 1 > last) continue;
      const std::vector<Expr> whole = dense_loads(*by_offset.begin()->second, start - lowest);
      for (const StridedLoad& load : family.loads) {
        const int64_t first = load.offset - start;
        if (first >= 0 && first < stride) replacements_[load.load.get()] = pick(whole, load, first);
      }
    }
  }

  // The stride * lanes elements from `distance` after the first of `lowest`.
  static std::vector<Expr> dense_loads(const StridedLoad& lowest, int64_t distance) {
    const auto* node = lowest.load.as<Load>();
    const int lanes = node->type.lanes();
    std::vector<Expr> result;
    for (int64_t i = 0; i < lowest.stride; ++i) {
      const Type type = lowest.base.type();
      const Expr base = binary(Kind::Add, lowest.base, make_const(type, distance + i * lanes));
      const Expr index = make_ramp(base, make_one(type), lanes);
      result.push_back(make_load(node->type, node->name, index, {}, node->symbol));
    }
    return result;
  }

  static Expr pick(const std::vector<Expr>& whole, const StridedLoad& load, int64_t first) {
    std::vector<int> indices;
    for (int i = 0; i < load.load.type().lanes(); ++i)
      indices.push_back(static_cast<int>(first + i * load.stride));
    return make_shuffle(whole, std::move(indices));
  }

  // The keys live as long as the statement that is rewritten.
  std::unordered_map<const ExprNode*, Expr> replacements_;
};

}  // namespace

Stmt deinterleave_loads(const Stmt& s) { return s.defined() ? LoadSharer()(s) : s; }

}  // namespace retrograde::ir
