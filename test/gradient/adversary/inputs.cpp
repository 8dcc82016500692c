// Images, parameters, and reads of them and of Funcs.
#include "frontend/language/boundary_conditions.h"
#include "gradient/adversary/maker.h"

namespace retrograde::gradient {

namespace {

template <typename Image>
Func bounded(Choices& choices, const Image& image, const Type& type) {
  using namespace BoundaryConditions;
  switch (choices.below(5)) {
    case 0:
      return repeat_edge(image);
    case 1:
      return constant_exterior(image, cast(type, Expr(0.5f)));
    case 2:
      return repeat_image(image);
    case 3:
      return mirror_image(image);
    default:
      return mirror_interior(image);
  }
}

}  // namespace

Type Maker::image_type() {
  switch (c_.below(13)) {
    case 12:
      return BFloat(16);
    case 10:
      return Float(64);
    case 11:
      return Float(16);
    default:
      return Float(32);
  }
}

void Maker::make_inputs() {
  p_.data = Buffer<int>(std::vector<int>{8}, "data");
  p_.data.get()->for_each_value([&](int& v) { v = c_.between(0, 7) - 1; });
  p_.scale.set(0.75f);
  p_.count.set(c_.chance(10) ? 0 : c_.between(1, 4));
  for (int n = c_.between(1, 2); n > 0; --n) {
    std::vector<int> sizes{c_.between(natural_size, 7)};
    if (c_.chance(50)) sizes.push_back(natural_size);
    Buffer<> image(image_type(), sizes, "image" + std::to_string(p_.images.size()));
    fill(image, c_.chance(15));
    p_.images.push_back(image);
    p_.handles.push_back(c_.chance(25) ? handle_of(image) : ImageParam());
  }
}

ImageParam Maker::handle_of(const Buffer<>& image) {
  ImageParam handle(oracle::type_of_buffer(*image.raw_buffer()), image.dimensions(),
                    image.name() + "_given");
  handle.set(image);
  return handle;
}

// So that a step of 2^-7 to either side, and a quarter of it, is exact in the type: in
// [0.25, 1.25], or in [0.27, 0.46] with 8 bits. ties: few values.
void Maker::fill(Buffer<>& image, bool ties) {
  const halide_buffer_t& raw = *image.raw_buffer();
  const Type type = oracle::type_of_buffer(raw);
  const int steps = ties ? 3 : type.is_bfloat() ? 97 : type.bits() == 16 ? 32 : 4096;
  const double low = type.is_bfloat() ? 0.265625 : 0.25,
               high = type.is_bfloat() ? 0.455078125 : 1.25;
  std::mt19937 random(static_cast<unsigned>(c_.below(1 << 16)));
  oracle::region_of(raw).for_each([&](const std::vector<int>& at) {
    const double value = low + (high - low) * (random() % static_cast<unsigned>(steps)) / steps;
    oracle::write_element(*image.raw_buffer(), at, ir::Scalar::of_float(type, value));
  });
}

Expr Maker::read_image(const Point& at) {
  const auto i = static_cast<size_t>(c_.below(static_cast<int>(p_.images.size())));
  const Buffer<>& image = p_.images[i];
  const ImageParam& handle = p_.handles[i];
  const bool is_bounded = c_.chance(30);
  std::vector<Expr> place;
  for (int d = 0; d < image.dimensions(); ++d) {
    const Expr extent = handle.defined() ? handle.dim(d).extent() : Expr(image.extent(d));
    const Expr u = coordinate(at, d);
    place.push_back(is_bounded ? places_.near(u, at.all) : places_.inside(u, at.all, extent));
  }
  if (!is_bounded) return handle.defined() ? handle(place) : image(place);
  const Type type = oracle::type_of_buffer(*image.raw_buffer());
  return (handle.defined() ? bounded(c_, handle, type) : bounded(c_, image, type))(place);
}

Expr Maker::coordinate(const Point& at, int d) {
  if (at.all.empty()) return Expr(c_.between(0, 3));
  if (d < static_cast<int>(at.all.size()) && !c_.chance(25)) return at.all[static_cast<size_t>(d)];
  return at.all[static_cast<size_t>(c_.below(static_cast<int>(at.all.size())))];
}

const Func& Maker::any_func() {
  return p_.funcs[static_cast<size_t>(c_.below(static_cast<int>(p_.funcs.size())))];
}

Expr Maker::any_value(const FuncRef& ref) {
  return ref.element(c_.below(static_cast<int>(ref.size())));
}

Expr Maker::read_func(const Point& at) {
  if (p_.funcs.empty()) return read_image(at);
  const Func& f = any_func();
  std::vector<Expr> place;
  for (int d = 0; d < f.dimensions(); ++d) place.push_back(places_.near(coordinate(at, d), at.all));
  return any_value(f(place));
}

// The Func that is being updated, where it is written or elsewhere.
Expr Maker::read_self(const Point& at) {
  std::vector<Expr> place = at.write;
  const bool elsewhere = c_.chance(60);
  for (size_t d = 0; d < place.size() && elsewhere; ++d) {
    if (!at.is_pure[d])
      place[d] = places_.near(c_.chance(30) ? coordinate(at, int(d)) : place[d], at.all);
  }
  return any_value(at.self(place));
}

}  // namespace retrograde::gradient
