// Terms become Exprs bottom up; every operand already has the type that the action wants.
#include "testing/build_pipeline.h"

#include "frontend/data/param.h"
#include "frontend/language/boundary_conditions.h"
#include "frontend/language/inline_reductions.h"
#include "testing/interpreter.h"

namespace retrograde::fuzz {

namespace {

constexpr uint32_t wide_noise_range = 60000;

uint32_t hash_of(uint32_t seed, const std::vector<int>& point) {
  uint32_t h = seed * 0x9e3779b9u + 0x85ebca6bu;
  for (const int x : point) {
    h = (h ^ static_cast<uint32_t>(x)) * 0xcc9e2d51u;
    h ^= h >> 15;
  }
  h *= 0x2c1b3c6du;
  return h ^ (h >> 13);
}

// All values of narrow integers, small ones of wide integers, floats between -4 and 4.
ir::Scalar noise(Type type, uint32_t h) {
  if (type.is_float()) {
    return ir::Scalar::of_float(type, (static_cast<int>(h >> 12) - (1 << 19)) / double(1 << 17));
  }
  if (type.bits() >= 32) h %= wide_noise_range;
  return type.is_int()
             ? ir::Scalar::of_int(
                   type, static_cast<int64_t>(h) - (type.bits() >= 32 ? wide_noise_range / 2 : 0))
             : ir::Scalar::of_uint(type, h);
}

Buffer<> make_image(const ImageSpec& spec, const std::string& name) {
  Buffer<> image(spec.type, spec.extents, name);
  image.set_min(spec.mins);
  halide_buffer_t& raw = *image.raw_buffer();
  oracle::region_of(raw).for_each([&](const std::vector<int>& point) {
    oracle::write_element(raw, point, noise(spec.type, hash_of(spec.seed, point)));
  });
  return image;
}

Func with_boundary(const Buffer<>& image, Boundary boundary) {
  switch (boundary) {
    case Boundary::Constant:
      return BoundaryConditions::constant_exterior(image, ir::make_const(image.type(), 7));
    case Boundary::RepeatEdge:
      return BoundaryConditions::repeat_edge(image);
    case Boundary::RepeatImage:
      return BoundaryConditions::repeat_image(image);
    case Boundary::MirrorImage:
      return BoundaryConditions::mirror_image(image);
    default:
      return BoundaryConditions::mirror_interior(image);
  }
}

class Builder {
 public:
  explicit Builder(const PipelineSpec& spec) : spec_(spec) {}

  BuiltPipeline run() {
    built_.vars = {Var("x"), Var("y"), Var("z")};
    for (size_t i = 0; i < spec_.images.size(); ++i) add_image(i);
    for (const ParameterSpec& p : spec_.parameters) parameters_.push_back(parameter(p));
    for (size_t f = 0; f < spec_.funcs.size(); ++f) add_func(f);
    return std::move(built_);
  }

 private:
  void add_image(size_t i) {
    const ImageSpec& image = spec_.images[i];
    built_.images.push_back(make_image(image, "image" + std::to_string(i)));
    bounded_images_.emplace_back();
    if (image.boundary != Boundary::Clamp) {
      bounded_images_.back() = with_boundary(built_.images.back(), image.boundary);
    }
  }

  static Expr parameter(const ParameterSpec& spec) {
    if (spec.type == Float(32)) {
      Param<float> p("p");
      p.set(spec.value / 8.0f);
      return p;
    }
    if (spec.type == UInt(8)) {
      Param<uint8_t> p("p");
      p.set(static_cast<uint8_t>(spec.value));
      return p;
    }
    Param<int32_t> p("p");
    p.set(static_cast<int32_t>(spec.value));
    return p;
  }

  void add_func(size_t f) {
    const FuncSpec& spec = spec_.funcs[f];
    built_.funcs.emplace_back("f" + std::to_string(f));
    Func& func = built_.funcs.back();
    variables_.assign(built_.vars.begin(), built_.vars.begin() + spec.dimensions);
    define(func, std::vector<Expr>(variables_), spec.values);
    for (const UpdateSpec& update : spec.updates) add_update(func, spec, update);
  }

  void define(Func& func, const std::vector<Expr>& left, const std::vector<Term>& values) {
    std::vector<Expr> exprs;
    for (const Term& value : values) exprs.push_back(expr(value));
    if (exprs.size() == 1) {
      func(left) = exprs[0];
    } else {
      func(left) = Tuple(exprs);
    }
  }

  static RDom domain_of(const std::vector<ReductionRange>& ranges) {
    retrograde::Region region;
    for (const ReductionRange& range : ranges) region.push_back({range.min, range.extent});
    return RDom(region, "r");
  }

  void add_update(Func& func, const FuncSpec& spec, const UpdateSpec& update) {
    variables_.resize(spec.dimensions);
    RDom domain;
    if (!update.domain.empty()) {
      domain = domain_of(update.domain);
      for (int k = 0; k < domain.dimensions(); ++k) variables_.push_back(domain[k]);
    }
    self_ = &func;
    if (!update.predicate.empty()) domain.where(expr(update.predicate[0]));
    std::vector<Expr> left;
    for (const Index& index : update.left) left.push_back(coordinate(index));
    define(func, left, update.values);
  }

  Expr coordinate(const Index& index) {
    Expr e = index.offset;
    if (!index.data.empty()) {
      e = expr(index.data[0]);
    } else if (index.variable >= 0) {
      e = variables_[index.variable];
      if (index.scale != 1) e = e * index.scale;
      if (index.divisor != 1) e = e / index.divisor;
      if (index.offset != 0) e = e + index.offset;
    }
    return index.clamped ? clamp(e, index.low, index.high) : e;
  }

  std::vector<Expr> coordinates(const Term& term) {
    std::vector<Expr> result;
    for (const Index& index : term.indices) result.push_back(coordinate(index));
    return result;
  }

  static Expr constant(const Term& term) {
    if (term.type.is_float()) return ir::make_const(term.type, term.value / 8.0);
    return ir::make_const(term.type, term.value);
  }

  static Expr access(const Func& func, const std::vector<Expr>& at, int element) {
    const FuncRef ref = func(at);
    return func.outputs() == 1 ? Expr(ref) : Expr(ref[element]);
  }

  Expr image_access(const Term& term) {
    const Func& bounded = bounded_images_[term.source];
    const std::vector<Expr> at = coordinates(term);
    return bounded.defined() ? Expr(bounded(at)) : built_.images[term.source](at);
  }

  Expr reduction(const Term& term) {
    const RDom domain = domain_of(term.domain);
    const size_t outer = variables_.size();
    for (int k = 0; k < domain.dimensions(); ++k) variables_.push_back(domain[k]);
    const Expr operand = expr(term.operands[0]);
    variables_.resize(outer);
    switch (term.action) {
      case Action::Sum:
        return sum(domain, operand);
      case Action::Product:
        return product(domain, operand);
      case Action::Maximum:
        return maximum(domain, operand);
      case Action::Minimum:
        return minimum(domain, operand);
      default:
        return argmax(domain, operand)[term.element];
    }
  }

  Expr expr(const Term& term) {
    switch (term.action) {
      case Action::Constant:
        return constant(term);
      case Action::Variable:
        return variables_[term.source];
      case Action::Parameter:
        return parameters_[term.source];
      case Action::Image:
        return image_access(term);
      case Action::Func:
        return access(built_.funcs[term.source], coordinates(term), term.element);
      case Action::Self:
        return access(*self_, coordinates(term), term.element);
      default:
        break;
    }
    if (is_inline_reduction(term.action)) return reduction(term);
    std::vector<Expr> e;
    for (const Term& operand : term.operands) e.push_back(expr(operand));
    return operation(term, e);
  }

  static Expr operation(const Term& term, const std::vector<Expr>& e) {
    switch (term.action) {
      case Action::Cast:
        return cast(term.type, e[0]);
      case Action::SaturatingCast:
        return saturating_cast(term.type, e[0]);
      case Action::Not:
        return !e[0];
      case Action::Negate:
        return -e[0];
      case Action::Abs:
        return abs(e[0]);
      case Action::Floor:
        return floor(e[0]);
      case Action::Sqrt:
        return sqrt(e[0]);
      case Action::Exp:
        return exp(e[0]);
      case Action::Sin:
        return sin(e[0]);
      case Action::Add:
        return e[0] + e[1];
      case Action::Sub:
        return e[0] - e[1];
      case Action::Mul:
        return e[0] * e[1];
      case Action::Div:
        return e[0] / e[1];
      case Action::Mod:
        return e[0] % e[1];
      case Action::Min:
        return min(e[0], e[1]);
      case Action::Max:
        return max(e[0], e[1]);
      case Action::Absd:
        return absd(e[0], e[1]);
      case Action::BitAnd:
        return e[0] & e[1];
      case Action::BitOr:
        return e[0] | e[1];
      case Action::BitXor:
        return e[0] ^ e[1];
      case Action::ShiftLeft:
        return e[0] << e[1];
      case Action::ShiftRight:
        return e[0] >> e[1];
      case Action::Less:
        return e[0] < e[1];
      case Action::LessEqual:
        return e[0] <= e[1];
      case Action::Equal:
        return e[0] == e[1];
      case Action::And:
        return e[0] && e[1];
      case Action::Or:
        return e[0] || e[1];
      case Action::Select:
        return select(e[0], e[1], e[2]);
      case Action::Clamp:
        return clamp(e[0], e[1], e[2]);
      case Action::Lerp:
        return lerp(e[0], e[1], e[2]);
      default:
        internal_error("a leaf is no operation");
    }
  }

  const PipelineSpec& spec_;
  BuiltPipeline built_;
  std::vector<Func> bounded_images_;  // undefined where indices are clamped instead
  std::vector<Expr> parameters_;
  std::vector<Expr> variables_;  // of the definition being built
  Func* self_ = nullptr;
};

}  // namespace

BuiltPipeline build(const PipelineSpec& pipeline) { return Builder(pipeline).run(); }

std::vector<oracle::Array> interpret(const std::vector<OutputSpec>& outputs,
                                     const BuiltPipeline& built, oracle::Rounding rounding) {
  std::vector<ir::FuncPtr> funcs;
  std::vector<oracle::Region> regions;
  for (const OutputSpec& output : outputs) {
    funcs.push_back(built.funcs[output.func].function());
    regions.push_back({output.mins, output.extents});
  }
  oracle::Interpreter interpreter(oracle::InterpreterOptions{.widen = false, .rounding = rounding});
  return interpreter.realize(funcs, regions);
}

}  // namespace retrograde::fuzz
