#include "gradient/adversary/probe.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <string_view>

#include "ir/visit.h"
#include "testing/check_program.h"
#include "testing/interpreter.h"

namespace retrograde::gradient {

void decide(Judgement judgement, const std::string& detail) { throw Verdict{{judgement, detail}}; }

void decide_by_access(const UserError& error) {
  if (fuzz::is_access_outside(error)) decide(Judgement::Broken, error.what());
}

void Product::add(double a, double b) {
  sum += a * b;
  magnitude += std::abs(a * b);
}
void Product::add(const Product& other) {
  sum += other.sum;
  magnitude += other.magnitude;
}
bool Product::is_finite() const { return std::isfinite(sum) && std::isfinite(magnitude); }

Buffer<float> Weights::over(const oracle::Region& region, const std::string& name) {
  Buffer<float> result(region.extents, name);
  result.set_min(region.mins);
  result.get()->for_each_value([&](float& v) { v = next(); });
  return result;
}
Buffer<float> Weights::signs_over(const oracle::Region& region, const std::string& name) {
  Buffer<float> result = over(region, name);
  result.get()->for_each_value([&](float& v) { v = sign(); });
  return result;
}

double as_double(const oracle::Value& v) { return v.is_undef() ? 0.0 : v.scalar.as_double(); }
double element(const Buffer<float>& buffer, const std::vector<int>& at) {
  return static_cast<double>(buffer.get()->operator()(at.data()));
}

std::vector<oracle::Array> interpret(const Func& f, const oracle::Region& region) {
  oracle::InterpreterOptions options;
  options.widen = true;
  options.max_points = max_points;
  options.max_operations = max_operations;
  return oracle::Interpreter(options).realize(f.function(), region);
}

std::vector<oracle::Array> evaluate(const Func& f, const oracle::Region& region) {
  try {
    return interpret(f, region);
  } catch (const UserError& error) {
    const std::string message = error.what();
    const bool is_large = message.find("InterpreterOptions::max_") != std::string::npos;
    decide(is_large ? Judgement::Illegal : Judgement::Wrong, f.name() + " " + message);
  }
}

Product weighted(const std::vector<oracle::Array>& arrays, const oracle::Region& region,
                 const std::vector<Buffer<float>>& weights) {
  Product result;
  for (size_t k = 0; k < arrays.size(); ++k) {
    if (!arrays[k].type.is_float()) continue;
    size_t i = 0;
    region.for_each([&](const std::vector<int>& at) {
      result.add(as_double(arrays[k].values[i++]), element(weights[k], at));
    });
  }
  return result;
}

Func reading(const std::vector<Buffer<float>>& buffers, const std::string& name) {
  std::vector<Var> vars;
  for (int d = 0; d < buffers[0].dimensions(); ++d) vars.push_back(Var::implicit(d));
  std::vector<Expr> place(vars.begin(), vars.end()), values;
  for (const Buffer<float>& b : buffers) values.push_back(b(place));
  Func f(name);
  f(vars) = Tuple(values);
  return f;
}

Func reading_inside(const std::vector<Buffer<float>>& buffers, const oracle::Region& region,
                    float outside) {
  std::vector<Var> vars;
  std::vector<Expr> place, values;
  Expr inside = ir::const_true();
  for (size_t d = 0; d < region.mins.size(); ++d) {
    vars.push_back(Var::implicit(static_cast<int>(d)));
    const int low = region.mins[d], high = low + region.extents[d] - 1;
    inside = inside && vars.back() >= low && vars.back() <= high;
    place.push_back(clamp(vars.back(), low, high));
  }
  for (const Buffer<float>& b : buffers) values.push_back(select(inside, b(place), outside));
  Func f("direction");
  f(vars) = Tuple(values);
  return f;
}

Motion::Motion(const AdversaryProgram& program, Weights& weights, const std::string& name)
    : p_(program) {
  for (const Buffer<>& image : p_.images)
    v_.push_back(
        weights.signs_over(oracle::region_of(*image.raw_buffer()), image.name() + "_" + name));
  of_scale_ = weights.sign();
}

Motion Motion::operator+(const Motion& other) const {
  Motion sum = *this;
  for (size_t i = 0; i < v_.size(); ++i) {
    sum.v_[i] = v_[i].copy();
    sum.v_[i].for_each_element([&](const int* at) { sum.v_[i](at) += other.v_[i](at); });
  }
  sum.of_scale_ += other.of_scale_;
  return sum;
}

std::vector<AdjointInput> Motion::inputs() const {
  std::vector<AdjointInput> result;
  for (size_t i = 0; i < p_.images.size(); ++i) result.push_back(p_.image(i));
  result.push_back(p_.scale);
  return result;
}

std::vector<Direction> Motion::directions() const {
  std::vector<Direction> result;
  for (size_t i = 0; i < p_.images.size(); ++i) result.emplace_back(p_.image(i), v_[i]);
  Buffer<float> along_scale = Buffer<float>::make_scalar();
  along_scale.get()->operator()() = of_scale_;
  result.emplace_back(p_.scale, along_scale);
  return result;
}

oracle::Region Motion::region(size_t input) const {
  if (input == p_.images.size()) return {};
  return oracle::region_of(*p_.images[input].raw_buffer());
}

void Motion::move(double by) const {
  for (size_t i = 0; i < p_.images.size(); ++i) {
    halide_buffer_t& raw = *const_cast<Buffer<>&>(p_.images[i]).raw_buffer();
    oracle::region_of(raw).for_each([&](const std::vector<int>& at) {
      ir::Scalar value = oracle::read_element(raw, at);
      value.f += by * element(v_[i], at);
      oracle::write_element(raw, at, value);
    });
  }
  const_cast<Param<float>&>(p_.scale).set(p_.scale.get() + static_cast<float>(by) * of_scale_);
}

Product Motion::along(const std::function<Func(const AdjointInput&)>& of) const {
  Product result;
  const std::vector<AdjointInput> all = inputs();
  for (size_t i = 0; i < all.size(); ++i) {
    const Func gradient = of(all[i]);
    if (!gradient.defined()) continue;
    const oracle::Array found = evaluate(gradient, region(i))[0];
    size_t k = 0;
    region(i).for_each([&](const std::vector<int>& at) {
      const double v = i < v_.size() ? element(v_[i], at) : static_cast<double>(of_scale_);
      result.add(as_double(found.values[k++]), v);
    });
  }
  return result;
}

Buffer<> room_for(const Type& type, const oracle::Region& region) {
  Buffer<> result(type, region.extents);
  result.set_min(region.mins);
  return result;
}

bool uses_fast_functions(const Func& output) {
  bool found = false;
  for (const graph::FuncPtr& f : graph::topological_order({output.function()})) {
    for (int s = 0; s < f->stage_count(); ++s) {
      graph::for_each_expr(f->stage(s), [&](const Expr& root) {
        ir::walk(root, [&](const Expr& e) {
          const auto* call = e.as<ir::Call>();
          found |= call && call->call_type == ir::CallType::Operator &&
                   std::string_view(ir::op_info(call->op).name).starts_with("fast_");
          return !found;
        });
      });
    }
  }
  return found;
}

bool is_finite(const oracle::Array& values) {
  return std::all_of(values.values.begin(), values.values.end(),
                     [](const oracle::Value& v) { return std::isfinite(as_double(v)); });
}

Region SeededOutput::bounds() const {
  Region result;
  for (size_t d = 0; d < region.mins.size(); ++d)
    result.push_back({Expr(region.mins[d]), Expr(region.extents[d])});
  return result;
}

Product Subject::total(const std::function<Product(const SeededOutput&)>& of) const {
  Product result;
  for (const SeededOutput& each : outputs) result.add(of(each));
  return result;
}

std::vector<OutputAdjoint> Subject::adjoints() const {
  std::vector<OutputAdjoint> result;
  for (const SeededOutput& each : outputs)
    result.push_back({each.output, each.seed, each.bounds()});
  return result;
}

AdjointOptions Subject::options() const {
  AdjointOptions result{.overwritten = Overwritten::Store};
  for (size_t i = 0; i < program.images.size(); ++i) result.wrt.push_back(program.image(i));
  result.wrt.push_back(program.scale);
  return result;
}

bool Subject::is_late() const { return std::clock() - begun > 10 * CLOCKS_PER_SEC; }

}  // namespace retrograde::gradient
