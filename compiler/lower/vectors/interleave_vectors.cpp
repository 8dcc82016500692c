// interleave_vectors -- split expressions that alternate between lanes by the residue of the lane.
// In:  Vector.
// Out: Vector; the same values are stored to the same elements.
//
//   out[ramp(b, 1, 8)] = select(ramp(b, 1, 8) % 2 == 0, f[ramp(b, 1, 8) / 2], g[ramp(b, 1, 8) / 2])
//      =>
//   out[ramp(b, 1, 8)] = interleave(
//       select(broadcast(b % 2 == 0, 4), f[ramp(b / 2, 1, 4)], g[ramp(b / 2, 1, 4)]),
//       select(broadcast((b + 1) % 2 == 0, 4), f[ramp((b + 1) / 2, 1, 4)], ...))
//
//   out[ramp(b, 3, 8)] = x                       out[ramp(b, 1, 24)] = interleave(x, y, z)
//   out[ramp(b + 1, 3, 8)] = y             =>
//   out[ramp(b + 2, 3, 8)] = z
//
// Gathers become dense loads, and scattered stores become dense stores.
//
// Method: expressions. A ramp of stride s, divided by c or taken modulo c, has the period k = c / gcd(s, c): its lanes
//         j, j + k, j + 2k ... are a ramp or a broadcast again. An expression has a period if every varying
//         part has one or can take every k-th lane at no cost (ramps, broadcasts). The largest such subtrees that
//         contain a load are split; dense loads stay whole. Splitting a node is linear in the nodes below it.
//         Stores: neighbouring stores to one buffer whose ramps have stride k and bases at distances 0 ... k - 1
//         become one store, if no stored value reads the buffer. An Atomic's load of its own element is not split, so
//         that load and store keep the same index.
// Not done: nested ramps; stores that are not neighbours.
// Source: folklore. Tests: test/golden/lower/interleave_vectors/, loop_passes_test.
#include "lower/statement_passes.h"

#include <algorithm>
#include <optional>

#include "ir/atomic_update.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "lower/vectors/lane_splitter.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

// The number of float lanes in an AVX-512 vector. Stores to the columns of a square of this size become a transpose,
// in four steps of shuffles instead of 256 scalar stores.
constexpr int max_store_period = 16;

// Neighbouring stores, each with its lets, that may become one store.
struct StoreGroup {
  std::string buffer;
  int64_t stride = 0;
  std::vector<Stmt> members;  // the original statements
  Lets lets;
  std::vector<const Store*> stores;
  std::vector<int64_t> offsets;  // from the first store's base
  Expr first_base;               // with the lets substituted

  bool is_complete() const { return static_cast<int64_t>(stores.size()) == stride; }
};

class Interleaver : public Rewriter {
 public:
  explicit Interleaver(const Stmt& s) : fresh_(s) {}

 protected:
  Expr rewrite(const Expr& e) override {
    if (e.type().is_scalar() && is_const(e)) return e;
    const Pattern p = splitter_.pattern(e);
    if (p.kind == Pattern::Periodic && p.has_load)
      return make_interleaved(splitter_.parts(e, p.period));
    return children(e);
  }

  Stmt rewrite(const Stmt& s) override {
    if (const auto* let = s.as<LetStmt>()) return visit_let(s, *let);
    if (const auto* atomic = s.as<Atomic>()) keep_own_loads(*atomic);
    const Stmt copy = children(s);
    const auto* block = copy.as<Block>();
    return block ? merge_stores(*block) : copy;
  }

 private:
  // ---- lets ----

  Stmt visit_let(const Stmt& s, const LetStmt& n) {
    if (n.value.type().is_scalar()) return children(s);
    const Pattern p = splitter_.pattern(n.value);
    if (p.kind != Pattern::Periodic || !p.has_load) {
      splitter_.bind(n.name, n.value, p.has_load ? whole_pattern : p);
      return children(s);
    }
    Lets parts;
    std::vector<Expr> variables;
    for (const Expr& value : splitter_.parts(n.value, p.period)) {
      parts.emplace_back(fresh_(n.name), value);
      variables.push_back(variable(parts.back().first, value.type()));
    }
    splitter_.bind(n.name, variables);
    return make_lets(parts, make_let(n.name, make_interleaved(variables), (*this)(n.body)));
  }

  // ---- stores ----

  // An Atomic is a single operation on its element only while its load and its store have the same index.
  void keep_own_loads(const Atomic& n) {
    const auto* store = n.body.as<Store>();
    if (!store) return;
    walk(store->value, [&](const Expr& e) {
      const auto* load = e.as<Load>();
      if (load && load->name == store->name) splitter_.keep_whole(e);
      return true;
    });
  }

  static Stmt merge_stores(const Block& block) {
    std::vector<Stmt> result;
    StoreGroup group;
    const auto flush = [&] {
      result.insert(result.end(), group.members.begin(), group.members.end());
      group = {};
    };
    for (const Stmt& s : block.stmts) {
      if (!joins(group, s)) {
        flush();
        if (!joins(group, s)) {
          result.push_back(s);
          continue;
        }
      }
      if (!group.is_complete()) continue;
      if (Stmt merged = one_store(group); merged.defined()) {
        result.push_back(merged);
        group = {};
      } else {
        flush();
      }
    }
    flush();
    return make_block(std::move(result));
  }

  // Adds the statement to the group; false if it does not belong there.
  static bool joins(StoreGroup& group, const Stmt& s) {
    Lets lets;
    Stmt inner = s;
    while (const auto* let = inner.as<LetStmt>()) {
      lets.emplace_back(let->name, let->value);
      inner = let->body;
    }
    const auto* store = inner.as<Store>();
    const auto* ramp = store && !store->predicate.defined() ? store->index.as<Ramp>() : nullptr;
    const auto stride =
        ramp && ramp->base.type().is_scalar() ? as_const_int(ramp->stride) : std::nullopt;
    if (!stride || *stride < 2 || *stride > max_store_period) return false;
    Expr base = ramp->base;
    for (size_t i = lets.size(); i-- > 0;) {
      if (lets[i].second.type().is_scalar()) base = substitute(base, lets[i].first, lets[i].second);
      if (loads_from(lets[i].second, store->name)) return false;
    }
    if (loads_from(store->value, store->name) || loads_from(base, store->name)) return false;
    if (group.stores.empty()) {
      group.buffer = store->name;
      group.stride = *stride;
      group.first_base = base;
    } else if (group.buffer != store->name || group.stride != *stride ||
               group.stores[0]->value.type() != store->value.type()) {
      return false;
    }
    const auto offset = as_const_int(simplify(binary(Kind::Sub, base, group.first_base)));
    if (!offset) return false;
    group.offsets.push_back(*offset);
    group.stores.push_back(store);
    group.members.push_back(s);
    group.lets.insert(group.lets.end(), lets.begin(), lets.end());
    return true;
  }

  // The merged store; undefined when the stores leave gaps.
  static Stmt one_store(const StoreGroup& group) {
    const size_t count = group.stores.size();
    const int64_t lowest = *std::min_element(group.offsets.begin(), group.offsets.end());
    std::vector<Expr> values(count);
    Expr base;
    for (size_t i = 0; i < count; ++i) {
      const auto place = static_cast<size_t>(group.offsets[i] - lowest);
      if (place >= count || values[place].defined()) return {};
      values[place] = group.stores[i]->value;
      if (place == 0) base = group.stores[i]->index.as<Ramp>()->base;
    }
    const int lanes = values[0].type().lanes() * static_cast<int>(count);
    const Expr index = make_ramp(base, make_one(base.type()), lanes);
    return make_lets(group.lets, make_store(group.buffer, make_interleaved(values), index, {},
                                            group.stores[0]->symbol));
  }

  FreshNames fresh_;
  LaneSplitter splitter_;
};

}  // namespace

Stmt interleave_vectors(const Stmt& s) { return s.defined() ? Interleaver(s)(s) : s; }

}  // namespace retrograde::lower
