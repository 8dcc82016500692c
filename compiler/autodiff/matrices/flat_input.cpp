#include "autodiff/matrices/flat_input.h"

#include "ir/build.h"

namespace retrograde::autodiff {

std::vector<Expr> expressions(const std::vector<Var>& vars) { return {vars.begin(), vars.end()}; }
std::vector<Var> variables(const std::string& base, size_t n) {
  return numbered(n, [&](size_t d) { return Var(base + std::to_string(d)); });
}
std::vector<Var> both(std::vector<Var> a, const std::vector<Var>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

InputShape flat(const InputShape& shape) {
  if (shape.types.size() == 1) return shape;
  Type type = Float(32);
  for (Type t : shape.types) {
    if (t.is_float() && t.bits() > type.bits()) type = t;
  }
  return {shape.name, shape.dimensions + 1, {type}};
}
Box flat(Box box, const InputShape& shape) {
  const int values = static_cast<int>(shape.types.size());
  if (values > 1) box.push_back({Expr(0), Expr(values - 1)});
  return box;
}

Func flat(const Func& f, const InputShape& shape) {
  if (!f.defined() || f.outputs() == 1) return f;
  const Type type = flat(shape).types[0];
  std::vector<Var> x = variables("x", static_cast<size_t>(shape.dimensions));
  Var value("value");
  Expr result = make_zero(type);
  for (int k = f.outputs() - 1; k >= 0; --k)
    result = select(value == k, cast(type, f(expressions(x)).element(k)), result);
  Func all(f.name() + "_values");
  all(both(x, {value})) = result;
  return all;
}

Func direction(const Func& seed, const InputShape& shape) {
  if (shape.types.size() == 1) return seed;
  std::vector<Var> x = variables("x", static_cast<size_t>(shape.dimensions));
  std::vector<Expr> values;
  for (size_t k = 0; k < shape.types.size(); ++k) {
    std::vector<Expr> place = expressions(x);
    place.emplace_back(static_cast<int>(k));
    values.push_back(shape.types[k].is_float() ? seed(place) : make_zero(Float(32)));
  }
  Func result(seed.name() + "_values");
  result(x) = Tuple(values);
  return result;
}

}  // namespace retrograde::autodiff
