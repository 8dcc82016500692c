// The generator: terms of a wanted type, top down, with a budget for reads so that inlining
// everything stays affordable.
#include "testing/random_pipeline.h"

#include <algorithm>

#include "testing/build_pipeline.h"

namespace retrograde::fuzz {

namespace {

// int32 values of Funcs are reduced modulo this, so that a few additions never overflow.
constexpr int wide_modulus = 4096;
constexpr int max_inlined_reads = 30;

bool is_wide(Type type) { return type.is_int_or_uint() && type.bits() >= 32; }

Term constant(Type type, int64_t value) {
  Term term;
  term.type = type;
  term.value = value;
  return term;
}

Term make(Action action, Type type, std::vector<Term> operands) {
  Term term;
  term.action = action;
  term.type = type;
  term.operands = std::move(operands);
  return term;
}

class Generator {
 public:
  explicit Generator(uint64_t seed) : random_(seed) {}

  PipelineSpec pipeline() {
    make_inputs();
    if (random_.chance(20)) {
      make_chain();
    } else {
      const int count = random_.between(2, 6);
      for (int i = 0; i < count; ++i) make_func(i == count - 1);
    }
    make_outputs();
    make_sweep();
    return std::move(spec_);
  }

 private:
  struct Context {
    int dimensions;
    std::vector<ReductionRange> rvars;  // of the update, then of the inline reduction
    bool may_reduce;
    int variables() const { return dimensions + static_cast<int>(rvars.size()); }
  };

  // ---- types and inputs ----

  Type random_type() {
    static const std::vector<Type> types = {
        UInt(8), UInt(8),  Int(8),  UInt(16), UInt(16),  Int(16),   Int(16),   Int(32),   Int(32),
        Int(32), UInt(32), Int(64), UInt(64), Float(32), Float(32), Float(32), Float(64), Bool()};
    return random_.pick(types);
  }

  Type random_number_type() {
    const Type type = random_type();
    return type.is_bool() ? UInt(8) : type;
  }

  void make_inputs() {
    const int images = random_.between(1, 2);
    for (int i = 0; i < images; ++i) {
      ImageSpec image;
      image.type = random_number_type();
      const int dimensions = random_.between(1, 3);
      for (int d = 0; d < dimensions; ++d) {
        image.mins.push_back(random_.chance(70) ? 0 : random_.between(-5, 5));
        image.extents.push_back(d == 2 ? random_.between(2, 4) : random_.between(5, 24));
      }
      image.boundary = static_cast<Boundary>(random_.below(6));
      image.seed = random_.below(1 << 30);
      spec_.images.push_back(image);
    }
    if (random_.chance(50)) {
      const Type type = random_.pick(std::vector<Type>{Int(32), UInt(8), Float(32)});
      spec_.parameters.push_back({type, random_.between(1, 20)});
    }
  }

  // ---- Funcs ----

  void make_func(bool is_last) {
    FuncSpec func;
    func.dimensions =
        is_last ? random_.between(1, 3) : random_.pick(std::vector<int>{0, 1, 1, 2, 2, 2, 3});
    const int values = random_.chance(20) ? 2 : 1;
    const Context context{func.dimensions, {}, true};
    reads_ = 0;
    const Type first = random_type();
    for (int v = 0; v < values; ++v) {
      const Type type = v == 0 || random_.chance(40) ? first : random_type();
      func.values.push_back(definition(type, context));
    }
    if (random_.chance(40)) {
      const int updates = random_.between(1, 2);
      for (int u = 0; u < updates; ++u) func.updates.push_back(update(func));
    }
    inlined_reads_.push_back(1 + reads_);
    spec_.funcs.push_back(std::move(func));
  }

  // A few stencils, each of the one before; some at half or at twice the resolution.
  void make_chain() {
    const int dimensions = random_.between(1, 2), count = random_.between(3, 7);
    const Type type = random_.pick(
        std::vector<Type>{UInt(8), UInt(16), UInt(16), Int(16), Int(32), Float(32), Float(32)});
    const Context context{dimensions, {}, false};
    for (int f = 0; f < count; ++f) {
      FuncSpec func;
      func.dimensions = dimensions;
      func.values = {f == 0 ? bounded(converted(image_leaf(context), type), wide_modulus)
                            : stencil(f - 1, type, dimensions)};
      inlined_reads_.push_back(std::min(max_inlined_reads, 1 << (2 * f)));
      spec_.funcs.push_back(std::move(func));
    }
  }

  Term stencil(int source, Type type, int dimensions) {
    const int reads = random_.between(2, 3), along = random_.below(dimensions);
    const int step = strided_ < 2 && random_.chance(20) ? 2 : 1;
    const int divisor = step == 1 && random_.chance(15) ? 2 : 1;
    strided_ += step == 2 ? 1 : 0;
    Term result;
    for (int i = 0; i < reads; ++i) {
      Term read;
      read.action = Action::Func;
      read.source = source;
      read.type = type;
      for (int d = 0; d < dimensions; ++d) {
        Index index;
        index.variable = d;
        if (d == along || random_.chance(20)) {
          index.scale = step;
          index.divisor = divisor;
          index.offset = i - random_.below(2);
        }
        read.indices.push_back(index);
      }
      result = i == 0 ? read
                      : make(random_.chance(75) ? Action::Add : Action::Max, type,
                             {std::move(result), std::move(read)});
    }
    if (random_.chance(50))
      result = make(Action::Div, type, {std::move(result), constant(type, reads)});
    return bounded(std::move(result), wide_modulus);
  }

  Term definition(Type type, const Context& context) {
    return bounded(term(type, random_.between(1, 3), context), wide_modulus);
  }

  // Keeps wide integers and floats small.
  static Term bounded(Term value, int modulus) {
    const Type type = value.type;
    if (is_wide(type)) return make(Action::Mod, type, {std::move(value), constant(type, modulus)});
    if (type.is_float()) {
      return make(Action::Clamp, type,
                  {std::move(value), constant(type, -8 * 100), constant(type, 8 * 100)});
    }
    return value;
  }

  UpdateSpec update(const FuncSpec& func) {
    UpdateSpec update;
    const int rank = random_.below(3);
    for (int k = 0; k < rank; ++k) {
      update.domain.push_back({random_.between(0, 4), random_.between(2, 7)});
    }
    Context context{func.dimensions, update.domain, false};
    std::vector<int> pure_here;
    for (int d = 0; d < func.dimensions; ++d) update.left.push_back(left_index(d, context));
    // A pure variable may be used only where its dimension stays pure.
    usable_.assign(context.variables(), true);
    for (int d = 0; d < func.dimensions; ++d) usable_[d] = is_pure(update.left[d], d);
    if (func.values.size() == 2 && random_.chance(50)) {
      update.values = joint_update(func, update, context);
    } else {
      const bool scan = random_.chance(25);
      const Action combine = random_.pick(std::vector<Action>{
          Action::Add, Action::Add, Action::Max, Action::Min, Action::Select, Action::Constant});
      for (size_t v = 0; v < func.values.size(); ++v) {
        const Type type = func.values[v].type;
        update.values.push_back(
            update_value(type, static_cast<int>(v), update, combine, scan, context));
      }
    }
    if (rank > 0 && random_.chance(35)) {
      update.predicate.push_back(term(Bool(), random_.between(1, 2), context));
    }
    usable_.clear();
    return update;
  }

  static bool is_pure(const Index& index, int d) {
    return index.variable == d && index.scale == 1 && index.divisor == 1 && index.offset == 0 &&
           !index.clamped && index.data.empty();
  }

  Index left_index(int d, const Context& context) {
    Index index;
    const int rvars = static_cast<int>(context.rvars.size());
    if (rvars > 0 && random_.chance(45)) {
      index.variable = context.dimensions + random_.below(rvars);
      index.offset = random_.chance(70) ? 0 : random_.between(-2, 2);
    } else if (rvars > 0 && random_.chance(15)) {
      usable_.assign(context.variables(), true);
      for (int i = 0; i < context.dimensions; ++i) usable_[i] = false;
      index = data_index(context);
      usable_.clear();
    } else if (random_.chance(12)) {
      index.offset = random_.between(0, 5);
    } else {
      index.variable = d;
    }
    return index;
  }

  Term update_value(Type type, int element, const UpdateSpec& update, Action combine, bool scan,
                    const Context& context) {
    Term fresh = bounded(term(type, random_.between(0, 2), context), 64);
    if (combine == Action::Constant && !scan) return fresh;
    Term self;
    self.action = Action::Self;
    self.type = type;
    self.element = element;
    self.indices = update.left;
    if (scan) step_back(self, context);
    if (type.is_bool()) return make(Action::Or, type, {self, fresh});
    if (combine == Action::Select) {
      return make(Action::Select, type, {term(Bool(), 1, context), self, fresh});
    }
    if (combine == Action::Max || combine == Action::Min) return make(combine, type, {self, fresh});
    if (type.is_float() && scan) {
      self = make(Action::Mul, type, {self, constant(type, 4)});
    }
    return make(Action::Add, type, {self, fresh});
  }

  static Term self_of(const FuncSpec& func, const UpdateSpec& update, int element) {
    Term self;
    self.action = Action::Self;
    self.type = func.values[element].type;
    self.element = element;
    self.indices = update.left;
    return self;
  }

  // Two values that need each other: the product of complex numbers, or the largest value so far
  // and something that belongs to it.
  std::vector<Term> joint_update(const FuncSpec& func, const UpdateSpec& update,
                                 const Context& context) {
    const Type type = func.values[0].type, other = func.values[1].type;
    const Term a = self_of(func, update, 0), b = self_of(func, update, 1);
    const Term c = bounded(term(type, random_.between(0, 2), context), 64);
    const Term d = bounded(term(other, random_.between(0, 1), context), 64);
    const bool wraps = type.is_int_or_uint() && type.bits() > 1 && type.bits() <= 16;
    if (type == other && wraps && random_.chance(50)) {
      const auto times = [&](const Term& x, const Term& y) {
        return make(Action::Mul, type, {x, y});
      };
      return {make(Action::Sub, type, {times(a, c), times(b, d)}),
              make(Action::Add, type, {times(a, d), times(b, c)})};
    }
    if (type.is_bool()) return {make(Action::Or, type, {a, c}), d};
    const Term better = make(Action::Less, Bool(), {a, c});
    return {make(Action::Select, type, {better, c, a}),
            make(Action::Select, other, {better, d, b})};
  }

  // f(r, y) reads f(r - 1, y).
  static void step_back(Term& self, const Context& context) {
    for (Index& index : self.indices) {
      if (index.variable >= context.dimensions && index.data.empty()) {
        index.offset -= 1;
        return;
      }
    }
  }

  void make_outputs() {
    const int last = static_cast<int>(spec_.funcs.size()) - 1;
    spec_.outputs.push_back(output(last));
    if (last > 0 && random_.chance(25))
      spec_.outputs.push_back(output(copy_of(random_.below(last))));
  }

  // A Func that the other output reads over a larger region cannot be an output itself.
  int copy_of(int source) {
    FuncSpec copy;
    copy.dimensions = spec_.funcs[source].dimensions;
    Term read;
    read.action = Action::Func;
    read.source = source;
    read.type = spec_.funcs[source].values[0].type;
    for (int d = 0; d < copy.dimensions; ++d) {
      Index index;
      index.variable = d;
      read.indices.push_back(index);
    }
    copy.values.push_back(std::move(read));
    spec_.funcs.push_back(std::move(copy));
    return static_cast<int>(spec_.funcs.size()) - 1;
  }

  // Runs over tiny and odd regions, somewhere else. Often: such sizes decide which schedules are
  // legal, so one program has few of them.
  void make_sweep() {
    if (!random_.chance(60)) return;
    const int runs = random_.between(1, 2);
    for (int i = 0; i < runs; ++i) {
      std::vector<RegionSpec> regions;
      for (const OutputSpec& main : spec_.outputs) {
        OutputSpec small = main;
        for (int& extent : small.extents) {
          extent = random_.pick(std::vector<int>{1, 1, 2, 3, 5, 7, 13});
        }
        for (int& min : small.mins) min = random_.chance(30) ? 0 : random_.between(-9, 9);
        for (const UpdateSpec& update : spec_.funcs[small.func].updates) cover(update, small);
        regions.push_back({small.mins, small.extents});
      }
      spec_.sweep.push_back(std::move(regions));
    }
  }

  OutputSpec output(int func) {
    static const std::vector<std::vector<int>> largest = {{}, {70}, {36, 20}, {16, 10, 4}};
    OutputSpec output;
    output.func = func;
    for (const int extent : largest[spec_.funcs[func].dimensions]) {
      output.extents.push_back(random_.between(1 + extent / 4, extent));
      output.mins.push_back(random_.chance(70) ? 0 : random_.between(-8, 8));
    }
    for (const UpdateSpec& update : spec_.funcs[func].updates) cover(update, output);
    return output;
  }

  // An output must hold whatever its updates touch.
  static void cover(const UpdateSpec& update, OutputSpec& output) {
    const int dimensions = static_cast<int>(output.mins.size());
    for (int d = 0; d < dimensions; ++d) {
      const Index& left = update.left[d];
      if (is_pure(left, d)) continue;
      int low = left.offset, high = left.offset;
      if (!left.data.empty()) {
        low = left.low;
        high = left.high;
      } else if (left.variable >= dimensions) {
        const ReductionRange& range = update.domain[left.variable - dimensions];
        low += range.min - 1;  // a scan reads one step back
        high += range.min + range.extent - 1;
      }
      const int end = std::max(output.mins[d] + output.extents[d], high + 1);
      output.mins[d] = std::min(output.mins[d], low);
      output.extents[d] = end - output.mins[d];
    }
  }

  // ---- terms ----

  Term term(Type type, int depth, const Context& context) {
    if (depth <= 0 || random_.chance(12)) return leaf(type, context);
    if (type.is_bool()) return condition(depth, context);
    if (random_.chance(12)) {
      return make(Action::Select, type,
                  {term(Bool(), depth - 1, context), term(type, depth - 1, context),
                   term(type, depth - 1, context)});
    }
    if (random_.chance(10)) return converted(term(random_number_type(), depth - 1, context), type);
    if (context.may_reduce && random_.chance(8)) return reduction(type, context);
    return type.is_float() ? float_term(type, depth, context) : integer_term(type, depth, context);
  }

  Term condition(int depth, const Context& context) {
    if (depth > 1 && random_.chance(30)) {
      const Action action = random_.chance(50) ? Action::And : Action::Or;
      return make(action, Bool(), {condition(depth - 1, context), condition(depth - 1, context)});
    }
    if (random_.chance(15)) return make(Action::Not, Bool(), {condition(depth - 1, context)});
    const Type type = random_number_type();
    const Action action =
        random_.pick(std::vector<Action>{Action::Less, Action::LessEqual, Action::Equal});
    return make(action, Bool(), {term(type, depth - 1, context), term(type, depth - 1, context)});
  }

  // |a| small enough that products of two do not overflow; narrow integers wrap by definition.
  Term factor(Type type, int depth, const Context& context) {
    Term value = term(type, depth, context);
    return is_wide(type) ? make(Action::Mod, type, {value, constant(type, 61)}) : value;
  }

  Term integer_term(Type type, int depth, const Context& context) {
    static const std::vector<Action> actions = {Action::Add,
                                                Action::Add,
                                                Action::Add,
                                                Action::Sub,
                                                Action::Sub,
                                                Action::Mul,
                                                Action::Mul,
                                                Action::Div,
                                                Action::Mod,
                                                Action::Min,
                                                Action::Max,
                                                Action::Absd,
                                                Action::BitAnd,
                                                Action::BitOr,
                                                Action::BitXor,
                                                Action::ShiftLeft,
                                                Action::ShiftRight,
                                                Action::Abs,
                                                Action::SaturatingCast,
                                                Action::Lerp};
    Action action = random_.pick(actions);
    const auto operand = [&] { return term(type, depth - 1, context); };
    switch (action) {
      case Action::Mul:
        return make(action, type,
                    {factor(type, depth - 1, context), factor(type, depth - 1, context)});
      case Action::Sub:
        // Unsigned and wide: no wrap-around through zero.
        if (type.is_uint() && is_wide(type)) action = Action::Max;
        return make(action, type, {operand(), operand()});
      case Action::Div:
      case Action::Mod:
        return divided(action, type, operand(), depth, context);
      case Action::Absd:
      case Action::Abs:
        return absolute(action, type, depth, context);
      case Action::ShiftLeft:
      case Action::ShiftRight:
        return shifted(action, type, depth, context);
      case Action::SaturatingCast:
        return make(action, type, {term(random_number_type(), depth - 1, context)});
      case Action::Lerp:
        if (type.is_int() || is_wide(type)) return make(Action::Min, type, {operand(), operand()});
        return make(action, type, {operand(), operand(), term(UInt(8), depth - 1, context)});
      case Action::BitXor:
      case Action::BitOr:
        if (is_wide(type)) action = Action::BitAnd;
        return make(action, type, {operand(), operand()});
      default:
        return make(action, type, {operand(), operand()});
    }
  }

  Term divided(Action action, Type type, Term value, int depth, const Context& context) {
    if (random_.chance(60)) {
      int64_t by = random_.between(1, 9);
      if (type.is_int() && random_.chance(30)) by = -by;
      return make(action, type, {std::move(value), constant(type, by)});
    }
    return make(action, type, {std::move(value), term(type, depth - 1, context)});
  }

  // Their results are unsigned: cast to what is wanted.
  Term absolute(Action action, Type type, int depth, const Context& context) {
    const Type from = type.is_uint() && random_.chance(50) ? type.with_code(TypeCode::Int) : type;
    std::vector<Term> operands = {term(from, depth - 1, context)};
    if (action == Action::Absd) operands.push_back(term(from, depth - 1, context));
    if (action == Action::Abs && from.is_uint()) return std::move(operands[0]);
    Term result = make(action, from.with_code(TypeCode::UInt), std::move(operands));
    return type.is_uint() ? result : converted(std::move(result), type);
  }

  Term shifted(Action action, Type type, int depth, const Context& context) {
    const int amount = random_.between(0, is_wide(type) ? 3 : type.bits() - 1);
    return make(action, type, {term(type, depth - 1, context), constant(type, amount)});
  }

  Term float_term(Type type, int depth, const Context& context) {
    static const std::vector<Action> actions = {
        Action::Add, Action::Add,   Action::Add,  Action::Sub, Action::Sub, Action::Mul,
        Action::Mul, Action::Mul,   Action::Div,  Action::Min, Action::Max, Action::Negate,
        Action::Abs, Action::Floor, Action::Sqrt, Action::Exp, Action::Sin, Action::Absd};
    const Action action = random_.pick(actions);
    Term a = term(type, depth - 1, context);
    switch (action) {
      case Action::Div: {
        Term b = make(Action::Abs, type, {term(type, depth - 1, context)});
        return make(action, type, {a, make(Action::Add, type, {b, constant(type, 8)})});
      }
      case Action::Sqrt:
        return make(action, type, {make(Action::Abs, type, {a})});
      case Action::Exp:
        return make(action, type,
                    {make(Action::Clamp, type, {a, constant(type, -16), constant(type, 16)})});
      case Action::Negate:
      case Action::Abs:
      case Action::Floor:
        return make(action, type, {a});
      case Action::Sin:
        return make(action, type,
                    {make(Action::Clamp, type, {a, constant(type, -80), constant(type, 80)})});
      default:
        return make(action, type, {a, term(type, depth - 1, context)});
    }
  }

  Term reduction(Type type, const Context& context) {
    Context inner = context;
    inner.may_reduce = false;
    const int rank = random_.between(1, 2);
    std::vector<ReductionRange> domain;
    for (int k = 0; k < rank; ++k) {
      domain.push_back({random_.between(-2, 1), random_.between(1, 4)});
      inner.rvars.push_back(domain.back());
    }
    Term operand = bounded(term(type, 1, inner), 64);
    std::vector<Action> actions = {Action::Sum, Action::Sum, Action::Maximum, Action::Minimum};
    if (type.is_int_or_uint() && !is_wide(type)) actions.push_back(Action::Product);
    if (!type.is_bool()) actions.push_back(Action::ArgMax);
    Term result = make(random_.pick(actions), type, {std::move(operand)});
    result.domain = std::move(domain);
    if (result.action != Action::ArgMax) return result;
    result.element = random_.below(rank + 1);
    if (result.element < rank) result.type = Int(32);
    return converted(std::move(result), type);
  }

  // ---- conversions ----

  // `value` as another type, within that type's range where leaving it has no meaning.
  static Term converted(Term value, Type type) {
    const Type from = value.type;
    if (from == type) return value;
    if (type.is_bool()) return make(Action::Less, Bool(), {constant(from, 1), std::move(value)});
    if (from.is_float() && type.is_int_or_uint()) {
      const int low = type.is_uint() ? 0 : -100, high = 100;
      value = make(Action::Clamp, from,
                   {std::move(value), constant(from, 8 * low), constant(from, 8 * high)});
    }
    if (from.is_int() && type.is_uint() && type.bits() >= 32) {
      value = make(Action::Max, from, {std::move(value), constant(from, 0)});
    }
    return make(Action::Cast, type, {std::move(value)});
  }

  // ---- leaves ----

  Term leaf(Type type, const Context& context) {
    const int choice = random_.below(100);
    if (choice < 15) return constant_leaf(type);
    if (choice < 30) return converted(variable_leaf(context), type);
    if (choice < 37 && !spec_.parameters.empty()) return converted(parameter_leaf(), type);
    if (choice < 75 && !spec_.funcs.empty()) return converted(func_leaf(context), type);
    return converted(image_leaf(context), type);
  }

  Term constant_leaf(Type type) {
    if (type.is_bool()) return constant(type, random_.below(2));
    return constant(type, type.is_uint() ? random_.between(0, 100) : random_.between(-100, 100));
  }

  int random_variable(const Context& context) {
    std::vector<int> candidates;
    for (int v = 0; v < context.variables(); ++v) {
      if (usable_.empty() || v >= static_cast<int>(usable_.size()) || usable_[v]) {
        candidates.push_back(v);
      }
    }
    return candidates.empty() ? -1 : random_.pick(candidates);
  }

  Term variable_leaf(const Context& context) {
    const int variable = random_variable(context);
    if (variable < 0) return constant(Int(32), 3);
    Term term;
    term.action = Action::Variable;
    term.source = variable;
    return term;
  }

  Term parameter_leaf() {
    Term term;
    term.action = Action::Parameter;
    term.type = spec_.parameters[0].type;
    return term;
  }

  Term image_leaf(const Context& context) {
    Term term;
    term.action = Action::Image;
    term.source = random_.below(static_cast<int>(spec_.images.size()));
    const ImageSpec& image = spec_.images[term.source];
    term.type = image.type;
    for (size_t d = 0; d < image.extents.size(); ++d) {
      Index index = access_index(static_cast<int>(d), context);
      if (image.boundary == Boundary::Clamp) {
        index.clamped = true;
        index.low = image.mins[d];
        index.high = image.mins[d] + image.extents[d] - 1;
      }
      term.indices.push_back(std::move(index));
    }
    return term;
  }

  Term func_leaf(const Context& context) {
    const int count = static_cast<int>(spec_.funcs.size());
    const int source = random_.chance(60) ? count - 1 : random_.below(count);
    if (reads_ + inlined_reads_[source] > max_inlined_reads) return image_leaf(context);
    reads_ += inlined_reads_[source];
    const FuncSpec& func = spec_.funcs[source];
    Term term;
    term.action = Action::Func;
    term.source = source;
    term.element = random_.below(static_cast<int>(func.values.size()));
    term.type = func.values[term.element].type;
    for (int d = 0; d < func.dimensions; ++d) term.indices.push_back(access_index(d, context));
    return term;
  }

  Index access_index(int d, const Context& context) {
    if (random_.chance(6) && context.may_reduce) return data_index(context);
    Index index;
    const bool same =
        d < context.dimensions && random_.chance(70) && (usable_.empty() || usable_[d]);
    index.variable = same ? d : random_variable(context);
    if (index.variable < 0 || random_.chance(5)) {
      index.variable = -1;
      index.offset = random_.between(0, 6);
      return index;
    }
    index.offset = random_.chance(50) ? 0 : random_.between(-3, 3);
    if (random_.chance(8) && strided_ < 3) {
      ++strided_;
      index.scale = random_.chance(80) ? 2 : -1;
    } else if (random_.chance(8)) {
      index.divisor = random_.between(2, 3);
    }
    return index;
  }

  Index data_index(const Context& context) {
    Index index;
    Context flat = context;
    flat.may_reduce = false;  // and no data index inside a data index
    index.data.push_back(term(Int(32), 1, flat));
    index.clamped = true;
    index.low = random_.between(-3, 2);
    index.high = index.low + random_.between(0, 12);
    return index;
  }

  Random random_;
  PipelineSpec spec_;
  std::vector<int> inlined_reads_;  // of each Func: leaves when everything is inlined into it
  int reads_ = 0;
  int strided_ = 0;
  std::vector<bool> usable_;  // variables of the update being made; empty: all
};

// Takes the reduction variables from what folds away: the terms of an update whose domain is gone.
void forget_domain(FuncSpec& func, int update) {
  const int first = func.dimensions;
  const int count = static_cast<int>(func.updates[update].domain.size());
  const auto renumbered = [&](int v) { return v < first ? v : v < first + count ? -1 : v - count; };
  const auto forget = [&](Index& index) { index.variable = renumbered(index.variable); };
  func.updates[update].domain.clear();
  func.updates[update].predicate.clear();
  for (Index& index : func.updates[update].left) forget(index);
  for_each_term_of_stage(func, update + 1, [&](Term& term) {
    for (Index& index : term.indices) forget(index);
    if (term.action != Action::Variable) return;
    term.source = renumbered(term.source);
    if (term.source < 0) term = constant(term.type, 0);
  });
}

// The language knows a reduction domain by its use: an update that does not mention it has none.
// Only the Funcs themselves tell, because constants fold when terms become expressions.
void drop_unused_domains(PipelineSpec& pipeline) {
  const BuiltPipeline built = build(pipeline);
  for (size_t f = 0; f < pipeline.funcs.size(); ++f) {
    for (size_t u = 0; u < pipeline.funcs[f].updates.size(); ++u) {
      const int update = static_cast<int>(u);
      if (built.funcs[f].rvars(update).empty()) forget_domain(pipeline.funcs[f], update);
    }
  }
}

}  // namespace

PipelineSpec random_pipeline(uint64_t seed) {
  PipelineSpec pipeline = Generator(seed).pipeline();
  drop_unused_domains(pipeline);
  return pipeline;
}

std::vector<std::vector<OutputSpec>> all_runs(const PipelineSpec& pipeline) {
  std::vector<std::vector<OutputSpec>> runs = {pipeline.outputs};
  for (const std::vector<RegionSpec>& regions : pipeline.sweep) {
    runs.push_back(pipeline.outputs);
    for (size_t o = 0; o < regions.size(); ++o) {
      runs.back()[o].mins = regions[o].mins;
      runs.back()[o].extents = regions[o].extents;
    }
  }
  return runs;
}

std::vector<bool> reachable_funcs(const PipelineSpec& pipeline) {
  std::vector<bool> reachable(pipeline.funcs.size(), false);
  std::vector<int> todo;
  const auto reach = [&](int f) {
    reachable[f] = true;
    todo.push_back(f);
  };
  for (const OutputSpec& output : pipeline.outputs) reach(output.func);
  while (!todo.empty()) {
    const FuncSpec& func = pipeline.funcs[todo.back()];
    todo.pop_back();
    for (size_t s = 0; s <= func.updates.size(); ++s) {
      for_each_term_of_stage(func, static_cast<int>(s), [&](const Term& term) {
        if (term.action == Action::Func && !reachable[term.source]) reach(term.source);
      });
    }
  }
  return reachable;
}

}  // namespace retrograde::fuzz
