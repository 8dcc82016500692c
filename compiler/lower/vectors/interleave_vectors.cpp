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
#include <numeric>
#include <optional>
#include <unordered_map>

#include "ir/atomic_update.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int max_pattern_period = 8;
// The number of float lanes in an AVX-512 vector. Stores to the columns of a square of this size become a transpose,
// in four steps of shuffles instead of 256 scalar stores.
constexpr int max_store_period = 16;

// How an expression behaves if it is split into every k-th lane.
struct Pattern {
  enum Kind { Any, Periodic, Whole } kind = Any;  // Whole: splitting costs more than it saves
  int period = 1;                                 // Periodic: the k into which it splits best
  bool has_load = false;
};

Pattern combine(const Pattern& a, const Pattern& b) {
  const bool has_load = a.has_load || b.has_load;
  const int period = std::lcm(a.period, b.period);
  if (a.kind == Pattern::Whole || b.kind == Pattern::Whole || period > max_pattern_period)
    return {Pattern::Whole, 1, has_load};
  return {std::max(a.kind, b.kind), period, has_load};
}

const Pattern whole{Pattern::Whole, 1, false};

// ramp / c or ramp % c, where stride and c are constants.
struct PeriodicIndex {
  Expr base;
  int64_t stride, divisor;
  int period() const { return static_cast<int>(divisor / std::gcd(stride, divisor)); }
};

std::optional<PeriodicIndex> as_periodic_index(const Expr& e) {
  if (e.kind() != Kind::Div && e.kind() != Kind::Mod) return std::nullopt;
  const auto* op = e.as<Binary>();
  const auto* ramp = op->a.as<Ramp>();
  if (!ramp || !ramp->base.type().is_scalar() || !e.type().is_int() || e.type().bits() < 32)
    return std::nullopt;
  const auto stride = as_const_int(ramp->stride), divisor = as_const_int(op->b);
  if (!stride || !divisor || *divisor <= 1 || *divisor > INT32_MAX) return std::nullopt;
  return PeriodicIndex{ramp->base, *stride, *divisor};
}

bool is_elementwise(const Call& call) {
  if (call.call_type != CallType::Operator) return false;
  const OpClass cls = op_info(call.op).cls;
  return cls == OpClass::Pure || cls == OpClass::Marker;
}

// Finds the patterns of expressions and splits expressions into parts. Names of vectors have the patterns of their
// values.
class LaneSplitter {
 public:
  Pattern pattern(const Expr& e) {
    if (e.type().is_scalar()) return {};
    if (const auto* found = find_or_null(patterns_, e.get())) return found->pattern;
    Pattern result = find_pattern(e);
    if (result.kind == Pattern::Periodic && e.type().lanes() % result.period != 0)
      result.kind = Pattern::Whole;
    patterns_.emplace(e.get(), Entry{e, result});
    return result;
  }

  // The parts of a subtree: interleaved, they equal e.
  std::vector<Expr> parts(const Expr& e, int period) {
    std::vector<Expr> result;
    for (int first = 0; first < period; ++first) {
      first_ = first;
      period_ = period;
      memo_.clear();
      result.push_back(part(e));
    }
    return result;
  }

  void keep_whole(const Expr& e) { patterns_.insert_or_assign(e.get(), Entry{e, whole}); }

  // Declares that `name`, which is bound to a vector, has pattern `p` and may be split.
  void bind(const std::string& name, const Expr& value, const Pattern& p) {
    names_[name] = {p, value, {}};
  }
  void bind(const std::string& name, const std::vector<Expr>& part_variables) {
    const int period = static_cast<int>(part_variables.size());
    names_[name] = {{Pattern::Periodic, period, true}, {}, part_variables};
  }

 private:
  struct Entry {
    Expr key;
    Pattern pattern;
  };
  struct Named {
    Pattern pattern;
    Expr value;               // recomputed in parts,
    std::vector<Expr> parts;  // unless the parts are bound to names of their own
  };

  Pattern find_pattern(const Expr& e) {
    return match(
        e, [&](const Variable& n) { return pattern_of_name(n); },
        [&](const Broadcast& n) { return n.value.type().is_scalar() ? Pattern{} : whole; },
        [&](const Ramp& n) { return n.base.type().is_scalar() ? Pattern{} : whole; },
        [&](const Binary& n) {
          if (const auto index = as_periodic_index(e))
            return index->period() > max_pattern_period
                       ? Pattern{}
                       : Pattern{index->period() == 1 ? Pattern::Any : Pattern::Periodic,
                                 index->period(), false};
          return combine(pattern(n.a), pattern(n.b));
        },
        [&](const Not& n) { return pattern(n.a); }, [&](const Cast& n) { return pattern(n.value); },
        [&](const Select& n) {
          return combine(pattern(n.condition),
                         combine(pattern(n.when_true), pattern(n.when_false)));
        },
        [&](const Load& n) { return pattern_of_load(n); },
        [&](const Let& n) {
          if (n.value.type().is_scalar()) return whole;
          const Pattern of_value = pattern(n.value);
          bind(n.name, n.value, of_value);
          return combine({Pattern::Any, of_value.period, of_value.has_load}, pattern(n.body));
        },
        [&](const Call& n) {
          Pattern result = is_elementwise(n) ? Pattern{} : whole;
          for (const Expr& arg : n.args) result = combine(result, pattern(arg));
          return result;
        },
        [&](const ExprNode&) { return whole; });
  }

  Pattern pattern_of_name(const Variable& n) const {
    const auto found = names_.find(n.name);
    return found == names_.end() ? whole : found->second.pattern;
  }

  Pattern pattern_of_load(const Load& n) {
    Pattern result = pattern(n.index);
    if (n.predicate.defined()) result = combine(result, pattern(n.predicate));
    const auto* ramp = n.index.as<Ramp>();
    if (ramp && !is_zero(ramp->stride)) result.kind = Pattern::Whole;
    result.has_load = true;
    return result;
  }

  Expr part(const Expr& e) {
    if (e.type().is_scalar()) return e;
    return memo_.get(e, [&] { return make_part(e); });
  }

  Expr make_part(const Expr& e) {
    const int lanes = e.type().lanes() / period_;
    return match(
        e,
        [&](const Variable& n) {
          const Named& named = names_.at(n.name);
          return named.parts.empty() ? part(named.value) : part_of_parts(named.parts, lanes);
        },
        [&](const Let& n) { return part(n.body); },
        [&](const Broadcast& n) { return make_broadcast(n.value, lanes); },
        [&](const Ramp& n) {
          const Type type = n.base.type();
          return make_sequence(
              binary(Kind::Add, n.base, binary(Kind::Mul, n.stride, make_const(type, first_))),
              binary(Kind::Mul, n.stride, make_const(type, period_)), lanes);
        },
        [&](const Binary& n) {
          const auto index = as_periodic_index(e);
          return index && index->stride * period_ % index->divisor == 0
                     ? part_of_index(e.kind(), *index, lanes)
                     : binary(e.kind(), part(n.a), part(n.b));
        },
        [&](const Not& n) { return logical_not(part(n.a)); },
        [&](const Cast& n) { return cast_to(n.type.with_lanes(lanes), part(n.value)); },
        [&](const Select& n) {
          return make_select(part(n.condition), part(n.when_true), part(n.when_false));
        },
        [&](const Load& n) {
          const Expr predicate = n.predicate.defined() ? part(n.predicate) : Expr();
          return make_load(n.type.with_lanes(lanes), n.name, part(n.index), predicate, n.symbol);
        },
        [&](const Call& n) {
          std::vector<Expr> args = mapped(n.args, [&](const Expr& arg) { return part(arg); });
          return call_op(n.op, n.type.with_lanes(lanes), std::move(args));
        },
        [&](const ExprNode&) -> Expr { internal_error("interleave_vectors: no parts"); });
  }

  // A name with fewer parts than the current period: its parts are split further.
  Expr part_of_parts(const std::vector<Expr>& parts, int lanes) const {
    const int count = static_cast<int>(parts.size()), step = period_ / count;
    const Expr& whole_part = parts.at(static_cast<size_t>(first_ % count));
    if (step == 1) return whole_part;
    std::vector<int> indices = numbered(lanes, [&](int i) { return first_ / count + i * step; });
    return make_shuffle({whole_part}, std::move(indices));
  }

  // (base + stride (first + period i)) / c = (base + stride first) / c + (stride period / c) i.
  Expr part_of_index(Kind kind, const PeriodicIndex& index, int lanes) const {
    const Type type = index.base.type();
    const Expr start = binary(Kind::Add, index.base, make_const(type, index.stride * first_));
    const Expr value = binary(kind, start, make_const(type, index.divisor));
    if (kind == Kind::Mod) return make_sequence(value, make_zero(type), lanes);
    const int64_t step = index.stride * period_ / index.divisor;
    return make_sequence(value, make_const(type, step), lanes);
  }

  static Expr make_sequence(const Expr& base, const Expr& stride, int lanes) {
    if (lanes == 1) return base;
    return is_zero(stride) ? make_broadcast(base, lanes) : make_ramp(base, stride, lanes);
  }

  std::unordered_map<const ExprNode*, Entry> patterns_;
  std::unordered_map<std::string, Named> names_;
  int first_ = 0, period_ = 1;
  NodeMemo<Expr> memo_;
};

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
      splitter_.bind(n.name, n.value, p.has_load ? whole : p);
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
