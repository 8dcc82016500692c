// Evaluation on demand. Recursion goes from Func to Func, so it is as deep as the pipeline; it runs on a stack of its
// own (diagnostics/large_stack.h). A branch of a select that is not chosen is never evaluated, so it may read outside
// of its producer's domain.
#include "testing/interpreter.h"

#include <HalideRuntime.h>

#include <algorithm>
#include <map>
#include <optional>
#include <unordered_map>

#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "ir/lets.h"
#include "ir/print.h"
#include "ir/random.h"
#include "ir/visit.h"

namespace retrograde::oracle {

using namespace graph;

namespace {

using Point = std::vector<int>;

struct PointHash {
  size_t operator()(const Point& point) const {
    uint64_t hash = 0x9e3779b97f4a7c15u;
    for (const int x : point) {
      hash = (hash ^ static_cast<uint32_t>(x)) * 0xff51afd7ed558ccdu;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

// A growing box; empty until the first point.
struct Hull {
  Point mins, maxs;
  bool empty = true;

  bool contains(const Point& p) const {
    if (empty) return false;
    for (size_t d = 0; d < p.size(); ++d) {
      if (p[d] < mins[d] || p[d] > maxs[d]) return false;
    }
    return true;
  }
  void include(const Point& p) {
    if (empty) {
      mins = maxs = p;
      empty = false;
    }
    for (size_t d = 0; d < p.size(); ++d) {
      mins[d] = std::min(mins[d], p[d]);
      maxs[d] = std::max(maxs[d], p[d]);
    }
  }
  bool contains(const Hull& other) const {
    return other.empty || (contains(other.mins) && contains(other.maxs));
  }
  void include(const Hull& other) {
    if (other.empty) return;
    include(other.mins);
    include(other.maxs);
  }
  Region region() const {
    Region result;
    for (size_t d = 0; d < mins.size(); ++d) {
      result.mins.push_back(mins[d]);
      result.extents.push_back(maxs[d] - mins[d] + 1);
    }
    return result;
  }
};

// A stage that is ready to run, and the values of its nodes at the current point; shared nodes have one value. A Func
// calls itself only through its own storage, so one frame for each stage suffices.
struct Frame {
  struct Slot {
    Value value;
    uint64_t epoch = 0;  // time of the computation
  };
  Definition definition;                           // without lets
  std::vector<bool> is_pure_arg;                   // args[d] is the pure variable d itself
  std::unordered_map<std::string, size_t> places;  // positions of its variables in the point
  std::unordered_map<const ExprNode*, Slot> slots;
  uint64_t epoch = 0;
  Point point;  // pure args, then rvars
};

Frame frame_of(const FuncContents& func, int stage) {
  Frame frame;
  frame.definition = map_exprs(func.stage(stage), without_lets);
  for (const std::string& arg : func.args) frame.places.emplace(arg, frame.places.size());
  for (const auto& rvar : frame.definition.rvars)
    frame.places.emplace(rvar.var, frame.places.size());
  for (size_t d = 0; d < func.args.size(); ++d) {
    const auto* variable = frame.definition.args[d].as<Variable>();
    frame.is_pure_arg.push_back(variable && variable->name == func.args[d]);
  }
  frame.point.resize(frame.places.size());
  return frame;
}

// Storage of one slice of a Func with updates, over a box of its scattered dimensions. Cells are initialised from the
// pure definition when first read.
struct Island {
  Region box;
  std::vector<Value> cells;  // point-major, one for each value of the Tuple
  std::vector<bool> written;
  Hull reached;  // accessed points, also outside of the box
  bool grows_on_store = true;
  bool poisoned = false;  // a store had an unstable index
};

struct FuncState {
  const FuncContents* func = nullptr;
  std::vector<Frame> stages;
  std::vector<int> pure_dims, scattered_dims;
  std::unordered_map<Point, std::vector<Value>, PointHash> memo;  // pure Funcs
  std::unordered_map<Point, std::vector<std::unique_ptr<Island>>, PointHash> slices;
  Island* active = nullptr;  // the island being computed
  Point active_slice;
};

Point pick(const Point& point, const std::vector<int>& dims) {
  Point result;
  for (const int d : dims) result.push_back(point[d]);
  return result;
}

std::string show(const Point& point) {
  std::string result = "(";
  for (size_t d = 0; d < point.size(); ++d) {
    result += (d ? ", " : "") + std::to_string(point[d]);
  }
  return result + ")";
}

}  // namespace

class Interpreter::Impl {
 public:
  explicit Impl(InterpreterOptions options) : options_(options) {}

  InterpreterOptions options_;
  std::map<const Symbol*, Hull> touched_;
  uint64_t operations_ = 0;

  std::vector<Array> realize(const std::vector<FuncPtr>& funcs,
                             const std::vector<Region>& regions) {
    states_.clear();
    std::vector<Array> result;
    for (size_t i = 0; i < funcs.size(); ++i) {
      if (regions[i].dimensions() != funcs[i]->dimensions()) {
        call_error("interpret " + quoted(funcs[i]->name),
                   "the region has as many dimensions as the Func",
                   text(regions[i].dimensions(), " instead of ", funcs[i]->dimensions()));
      }
      realize_one(*funcs[i], regions[i], result);
    }
    return result;
  }

 private:
  void realize_one(const FuncContents& func, const Region& region, std::vector<Array>& result) {
    FuncState& state = state_of(func);
    const size_t first = result.size();
    for (const Type& type : func.types)
      result.push_back({widened(type), region, std::vector<Value>(region.points())});
    size_t index = 0;
    region.for_each([&](const Point& point) {
      for (size_t v = 0; v < func.types.size(); ++v) {
        result[first + v].values[index] = read(state, point, static_cast<int>(v));
      }
      ++index;
    });
  }

  FuncState& state_of(const FuncContents& func) {
    auto& state = states_[&func];
    if (!state) {
      if (!func.is_defined()) {
        user_error("interpret " + quoted(func.name), "a Func needs a pure definition first");
      }
      state = make_state(func);
    }
    return *state;
  }

  std::unique_ptr<FuncState> make_state(const FuncContents& func) const {
    if (func.is_extern()) {
      unsupported("interpret " + quoted(func.name), "a Func is evaluated by its definitions",
                  "the C function " + quoted(func.extern_definition->function) + " computes it",
                  "Interpret a Func that does not depend on it");
    }
    auto state = std::make_unique<FuncState>();
    state->func = &func;
    for (int s = 0; s < func.stage_count(); ++s) state->stages.push_back(frame_of(func, s));
    for (int d = 0; d < func.dimensions(); ++d) {
      const bool pure = std::all_of(state->stages.begin(), state->stages.end(),
                                    [&](const Frame& f) { return f.is_pure_arg[d]; });
      (pure ? state->pure_dims : state->scattered_dims).push_back(d);
    }
    return state;
  }

  // ---- values of Funcs ----

  Value read(FuncState& f, const Point& point, int component) {
    if (f.func->is_pure()) return pure_values(f, point)[component];
    const Point slice = pick(point, f.pure_dims);
    const Point place = pick(point, f.scattered_dims);
    if (f.active) return read_self(f, point, slice, place, component);
    Island& island = island_at(f, slice, place);
    const Value value = cell(f, island, point, place)[component];
    return island.poisoned ? Value::unstable(value.scalar) : value;
  }

  const std::vector<Value>& pure_values(FuncState& f, const Point& point) {
    if (const auto* it = ir::find_or_null(f.memo, point)) return *it;
    std::vector<Value> values = evaluate_pure(f, point);
    check_size(f, f.memo.size());
    return f.memo.emplace(point, std::move(values)).first->second;
  }

  std::vector<Value> evaluate_pure(FuncState& f, const Point& point) {
    Frame& frame = f.stages[0];
    std::copy(point.begin(), point.end(), frame.point.begin());
    ++frame.epoch;
    return all_of(frame, frame.definition.values);
  }

  void check_size(const FuncState& f, size_t points) const {
    if (points >= options_.max_points) {
      call_error("interpret " + quoted(f.func->name),
                 "a Func is evaluated at a bounded number of points",
                 text("more than ", options_.max_points), "Raise InterpreterOptions::max_points.");
    }
  }

  void check_work() const {
    if (operations_ > options_.max_operations) {
      call_error("interpret the program", "a run has a bounded number of operations",
                 text("more than ", options_.max_operations),
                 "Raise InterpreterOptions::max_operations.");
    }
  }

  // The cells of a point inside of the island's box.
  Value* cell(FuncState& f, Island& island, const Point& point, const Point& place) {
    size_t index = 0, stride = 1;
    for (size_t d = 0; d < place.size(); ++d) {
      index += (place[d] - island.box.mins[d]) * stride;
      stride *= island.box.extents[d];
    }
    Value* values = &island.cells[index * f.func->types.size()];
    if (!island.written[index]) {
      island.written[index] = true;
      const std::vector<Value> initial = evaluate_pure(f, point);
      std::copy(initial.begin(), initial.end(), values);
    }
    return values;
  }

  static bool inside(const Region& box, const Point& place) {
    for (size_t d = 0; d < place.size(); ++d) {
      if (place[d] < box.mins[d] || place[d] >= box.mins[d] + box.extents[d]) return false;
    }
    return true;
  }

  Value read_self(FuncState& f, const Point& point, const Point& slice, const Point& place,
                  int component) {
    if (slice != f.active_slice) {
      internal_error(quoted(f.func->name) + " reads itself at " + show(point) +
                     ", across a dimension that is pure in all of its definitions");
    }
    f.active->reached.include(place);
    if (!inside(f.active->box, place)) return evaluate_pure(f, point)[component];
    return cell(f, *f.active, point, place)[component];
  }

  Island& island_at(FuncState& f, const Point& slice, const Point& place) {
    auto& islands = f.slices[slice];
    for (auto& island : islands) {
      if (inside(island->box, place)) return *island;
    }
    // Later islands need not hold the stores: they lie outside of the points that the stores access.
    auto island = std::make_unique<Island>();
    island->grows_on_store = islands.empty();
    compute(f, slice, place, *island);
    islands.push_back(std::move(island));
    return *islands.back();
  }

  void compute(FuncState& f, const Point& slice, const Point& place, Island& island) {
    Hull hull;
    hull.include(place);
    do {
      hull.include(island.reached);
      island.box = hull.region();
      const size_t points = island.box.points();
      check_size(f, points);
      island.cells.assign(points * f.func->types.size(), Value());
      island.written.assign(points, false);
      f.active = &island;
      f.active_slice = slice;
      for (size_t s = 1; s < f.stages.size(); ++s) run_update(f, f.stages[s], island);
      f.active = nullptr;
    } while (!hull.contains(island.reached));
  }

  // ---- updates ----

  void run_update(FuncState& f, Frame& frame, Island& island) {
    std::fill(frame.point.begin(), frame.point.end(), 0);
    for (size_t i = 0; i < f.pure_dims.size(); ++i) frame.point[f.pure_dims[i]] = f.active_slice[i];
    Region loops;                // the reduction domain, then the stage's pure dimensions
    std::vector<int> positions;  // in frame.point
    add_reduction_loops(f, frame, loops, positions);
    for (size_t i = 0; i < f.scattered_dims.size(); ++i) {
      if (!frame.is_pure_arg[f.scattered_dims[i]]) continue;
      loops.mins.push_back(island.box.mins[i]);
      loops.extents.push_back(island.box.extents[i]);
      positions.push_back(f.scattered_dims[i]);
    }
    loops.for_each([&](const Point& at) {
      for (size_t i = 0; i < at.size(); ++i) frame.point[positions[i]] = at[i];
      update_points(f, frame, island);
    });
  }

  void add_reduction_loops(FuncState& f, Frame& frame, Region& loops, std::vector<int>& positions) {
    ++frame.epoch;
    int position = f.func->dimensions();
    for (const auto& rvar : frame.definition.rvars) {
      if (rvar.numbers_points) continue;
      loops.mins.push_back(static_cast<int>(get(frame, rvar.min).scalar.i));
      loops.extents.push_back(static_cast<int>(get(frame, rvar.extent).scalar.i));
      positions.push_back(position++);
    }
  }

  // The store of an update at one point.
  struct Stored {
    Point point;
    std::vector<Value> values;
    bool unsure = false;  // the store itself depends on an unstable condition
  };

  // Computes all points of an iteration before the first is stored.
  void update_points(FuncState& f, Frame& frame, Island& island) {
    const ReductionVariable* number = point_number(frame.definition);
    std::vector<Stored> all;
    for (int i = 0; i < number_of_points(frame.definition); ++i) {
      if (number) frame.point.back() = i;
      ++frame.epoch;
      if (auto stored = update_at(frame, island)) all.push_back(std::move(*stored));
    }
    for (const Stored& s : all) store(f, island, s.point, s.values, s.unsure);
  }

  std::optional<Stored> update_at(Frame& frame, Island& island) {
    Stored result;
    if (frame.definition.predicate.defined()) {
      const Value& condition = get(frame, frame.definition.predicate);
      result.unsure = !condition.is_stable();
      if (!result.unsure && !condition.scalar.as_bool()) return std::nullopt;
    }
    result.values = all_of(frame, frame.definition.values);
    bool stable = true;
    result.point = coordinates(frame, frame.definition.args, stable);
    if (!stable) island.poisoned = true;
    return result;
  }

  void store(FuncState& f, Island& island, const Point& point, const std::vector<Value>& values,
             bool unsure) {
    const bool nothing = std::ranges::all_of(values, [](const Value& v) { return v.is_undef(); });
    if (nothing) return;
    const Point place = pick(point, f.scattered_dims);
    if (island.grows_on_store) island.reached.include(place);
    if (!inside(island.box, place)) return;
    Value* cells = cell(f, island, point, place);
    for (size_t v = 0; v < values.size(); ++v) {
      if (values[v].is_undef()) continue;
      cells[v] = unsure ? Value::unstable(values[v].scalar) : values[v];
    }
  }

  // ---- expressions ----

  Type widened(Type type) const { return options_.widen && type.is_float() ? Float(64) : type; }

  const Value& get(Frame& frame, const Expr& e) {
    Frame::Slot& slot = frame.slots[e.get()];
    if (slot.epoch != frame.epoch) {
      slot.value = evaluate(frame, e);
      slot.epoch = frame.epoch;
    }
    return slot.value;
  }

  std::vector<Value> all_of(Frame& frame, const std::vector<Expr>& exprs) {
    return ir::mapped(exprs, [&](const Expr& e) { return get(frame, e); });
  }

  Value evaluate(Frame& frame, const Expr& e) {
    check_work();
    return match(
        e, [&](const Variable& n) { return variable(frame, e, n); },
        [&](const Cast& n) {
          ++operations_;
          return apply_cast(options_.rounding, widened(n.type), get(frame, n.value));
        },
        [&](const Reinterpret& n) { return reinterpret(frame, n); },
        [&](const Binary& n) { return binary(frame, n); },
        [&](const Not& n) {
          ++operations_;
          return apply_not(get(frame, n.a));
        },
        [&](const Select& n) { return select(frame, n.condition, n.when_true, n.when_false); },
        [&](const Call& n) { return call(frame, n); },
        [&](const ExprNode&) { return constant(e); });
  }

  Value constant(const Expr& e) const {
    const auto scalar = e.type().is_scalar() ? as_scalar(e) : std::nullopt;
    if (!scalar) internal_error("not part of an algorithm: " + ir::print(e));
    Value result{*scalar};
    result.scalar.type = widened(e.type());
    return result;
  }

  Value variable(const Frame& frame, const Expr& e, const Variable& n) const {
    const auto place = frame.places.find(n.name);
    if (place != frame.places.end()) return {Scalar::of_int(Int(32), frame.point[place->second])};
    const auto* parameter = dynamic_cast<const ParameterContents*>(n.symbol.raw());
    if (!parameter) internal_error("unbound variable " + quoted(n.name));
    return parameter->is_buffer ? buffer_fact(*parameter, n) : value_of(*parameter, e.type());
  }

  // Short-circuit evaluation: if one operand of && or || decides, the other is not evaluated.
  Value binary(Frame& frame, const Binary& n) {
    ++operations_;
    const Value& a = get(frame, n.a);
    if ((n.kind == Kind::And || n.kind == Kind::Or) && !a.is_undef()) {
      const bool deciding = n.kind == Kind::Or;
      if (a.is_stable() && a.scalar.as_bool() == deciding) return a;
      const Value& b = get(frame, n.b);
      if (!b.is_undef() && b.is_stable() && b.scalar.as_bool() == deciding) return b;
    }
    return apply_binary(options_.rounding, n.kind, a, get(frame, n.b));
  }

  Value select(Frame& frame, const Expr& if_true, const Expr& a, const Expr& b) {
    ++operations_;
    const Value& condition = get(frame, if_true);
    if (condition.is_undef()) return condition;
    return steady(get(frame, condition.scalar.as_bool() ? a : b), condition.is_stable());
  }

  static Value steady(const Value& value, bool stable) {
    return stable || value.is_undef() ? value : Value::unstable(value.scalar);
  }

  Value reinterpret(Frame& frame, const Reinterpret& n) {
    ++operations_;
    const Value exact = apply_cast(options_.rounding, n.value.type(), get(frame, n.value));
    return apply_cast(options_.rounding, widened(n.type), apply_reinterpret(n.type, exact));
  }

  Value call(Frame& frame, const Call& n) {
    switch (n.call_type) {
      case CallType::Func:
        return func_call(frame, n);
      case CallType::Image:
        return image_call(frame, n);
      case CallType::Extern:
        unsupported("interpret a call of " + quoted(n.name),
                    "a value is computed by operators, not by C functions");
      case CallType::Operator:
        break;
    }
    switch (n.op) {
      case Op::undef:
        return Value::undef();
      case Op::random:
        return random(frame, n);
      case Op::require:
        return require(frame, n);
      case Op::if_then_else:
        return select(frame, n.args[0], n.args[1], n.args[2]);
      case Op::print:
      case Op::print_when:
        return get(frame, n.args[n.op == Op::print ? 0 : 1]);
      default:
        ++operations_;
        return apply_operator(options_.rounding, n.op, all_of(frame, n.args), widened(n.type));
    }
  }

  Value random(Frame& frame, const Call& n) {
    std::vector<uint32_t> words;
    bool stable = true;
    for (const Value& word : all_of(frame, n.args)) {
      words.push_back(static_cast<uint32_t>(word.scalar.u));
      stable &= word.is_stable();
    }
    const uint32_t bits = random_bits(words.data(), static_cast<int>(words.size()));
    const Scalar number = n.type.is_float() ? Scalar::of_float(n.type, random_float(bits))
                                            : Scalar::of_uint(UInt(32), bits);
    return steady(apply_cast(Rounding::Strict, widened(n.type), {number}), stable);
  }

  Value require(Frame& frame, const Call& n) {
    if (get(frame, n.args[0]).scalar.as_bool()) return get(frame, n.args[1]);
    std::string message;
    for (size_t i = 2; i < n.args.size(); ++i) {
      const auto* words = n.args[i].as<StringImm>();
      message += text(message.empty() ? "" : " ",
                      words ? words->value : text(get(frame, n.args[i]).scalar.as_double()));
    }
    call_error("interpret", "the condition of a require holds", message);
  }

  // ---- inputs of the pipeline ----

  Value value_of(const ParameterContents& p, Type type) const {
    if (!p.value)
      call_error("interpret with parameter " + quoted(p.name), "every parameter needs a value");
    return apply_cast(Rounding::Strict, widened(type), {*p.value});
  }

  static const halide_buffer_t& buffer_of(const ParameterContents& p) {
    if (!p.buffer || !p.buffer->host)
      call_error("interpret with image " + quoted(p.name), "every image needs a host buffer");
    return *p.buffer;
  }

  // "in.extent.1"
  static Value buffer_fact(const ParameterContents& p, const Variable& n) {
    const std::string fact = n.name.substr(p.name.size());
    const size_t dot = fact.rfind('.');
    const int d = std::stoi(fact.substr(dot + 1));
    const halide_dimension_t& dim = buffer_of(p).dim[d];
    const std::string kind = fact.substr(1, dot - 1);
    const int value = kind == "min" ? dim.min : kind == "extent" ? dim.extent : dim.stride;
    return {Scalar::of_int(n.type, value)};
  }

  Point coordinates(Frame& frame, const std::vector<Expr>& args, bool& stable) {
    Point point;
    for (const Expr& arg : args) {
      const Value& coordinate = get(frame, arg);
      stable &= coordinate.is_stable();
      point.push_back(static_cast<int>(coordinate.scalar.i));
    }
    return point;
  }

  Value func_call(Frame& frame, const Call& n) {
    bool stable = true;
    const Point point = coordinates(frame, n.args, stable);
    FuncState& callee = state_of(*static_cast<const FuncContents*>(n.symbol.raw()));
    return steady(read(callee, point, n.component), stable);
  }

  Value image_call(Frame& frame, const Call& n) {
    bool stable = true;
    const Point point = coordinates(frame, n.args, stable);
    const auto& p = *static_cast<const ParameterContents*>(n.symbol.raw());
    const halide_buffer_t& buffer = buffer_of(p);
    if (!inside(region_of(buffer), point)) {
      call_error("interpret", "an image is read inside of its bounds",
                 quoted(p.name) + " is read at " + show(point));
    }
    touched_[&p].include(point);
    const Value value =
        apply_cast(Rounding::Strict, widened(n.type), {read_element(buffer, point)});
    return steady(value, stable);
  }

  std::unordered_map<const FuncContents*, std::unique_ptr<FuncState>> states_;
};

Interpreter::Interpreter(InterpreterOptions options) : impl_(std::make_unique<Impl>(options)) {}
Interpreter::~Interpreter() = default;

std::vector<Array> Interpreter::realize(const FuncPtr& func, const Region& region) {
  return realize(std::vector<FuncPtr>{func}, std::vector<Region>{region});
}

std::vector<Array> Interpreter::realize(const std::vector<FuncPtr>& funcs,
                                        const std::vector<Region>& regions) {
  std::vector<Array> result;
  run_on_large_stack([&] { result = impl_->realize(funcs, regions); });
  return result;
}

Region Interpreter::touched(const ParameterContents& image) const {
  const auto it = impl_->touched_.find(&image);
  return it == impl_->touched_.end() ? Region{} : it->second.region();
}

}  // namespace retrograde::oracle
