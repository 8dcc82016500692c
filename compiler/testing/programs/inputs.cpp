// Images, parameters, and reads of them and of Funcs.
#include "testing/programs/maker.h"

namespace retrograde::fuzz {

void Maker::make_inputs() {
  p_.scale.set(0.75f);
  if (s_.has_exact_reads) return make_exact_image();
  p_.data = Buffer<int>(std::vector<int>{8}, "data");
  p_.data.get()->for_each_value([&](int& v) { v = c_.between(0, 7) - 1; });
  p_.count.set(c_.chance(10) ? 0 : c_.between(1, 4));
  p_.narrow.set(static_cast<uint8_t>(c_.between(1, 20)));
  for (int n = c_.between(1, 2); n > 0; --n) {
    std::vector<int> sizes{c_.between(natural_size, s_.largest_image)}, mins;
    if (c_.chance(50)) sizes.push_back(c_.between(natural_size, s_.largest_image));
    if (s_.image_dimensions > 2 && c_.chance(30))
      sizes = {sizes[0], sizes.back(), c_.between(2, 4)};
    for (size_t d = 0; d < sizes.size(); ++d)
      mins.push_back(s_.has_integers && c_.chance(30) ? c_.around_zero(5) : 0);
    Buffer<> image(c_.pick(s_.image_types), sizes, "image" + std::to_string(p_.images.size()));
    image.set_min(mins);
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

// Fills an image. Floats are such that a step of 2^-7 to either side, and a quarter of it, is exact in the type: in
// [0.25, 1.25], or in [0.27, 0.46] with 8 bits. With integers, floats are in [-4, 4]; narrow integers take all values,
// and wide ones small values. `ties`: few distinct values.
void Maker::fill(Buffer<>& image, bool ties) {
  const halide_buffer_t& raw = *image.raw_buffer();
  const Type type = oracle::type_of_buffer(raw);
  const unsigned steps = ties                ? 3
                         : !type.is_float()  ? 60000
                         : type.is_bfloat()  ? 97
                         : type.bits() == 16 ? 32
                                             : 4096;
  const double low = s_.has_integers    ? -4.0
                     : type.is_bfloat() ? 0.265625
                                        : 0.25,
               high = s_.has_integers    ? 4.0
                      : type.is_bfloat() ? 0.455078125
                                         : 1.25;
  std::mt19937 random(static_cast<unsigned>(c_.below(1 << 16)));
  oracle::region_of(raw).for_each([&](const std::vector<int>& at) {
    const unsigned step = random() % steps;
    const auto wide = static_cast<int64_t>(step) - (type.is_uint() ? 0 : 30000);
    const ir::Scalar value = type.is_float()
                                 ? ir::Scalar::of_float(type, low + (high - low) * step / steps)
                             : type.is_int() ? ir::Scalar::of_int(type, wide)
                                             : ir::Scalar::of_uint(type, step);
    oracle::write_element(*image.raw_buffer(), at, value);
  });
}

Expr Maker::read_image(const Point& at) {
  const auto i = static_cast<size_t>(c_.below(static_cast<int>(p_.images.size())));
  const Buffer<>& image = p_.images[i];
  const ImageParam& handle = p_.handles[i];
  const bool is_bounded = c_.chance(30);
  std::vector<Expr> place;
  for (int d = 0; d < image.dimensions(); ++d) {
    if (is_bounded) {
      place.push_back(this->place(at, d));
      continue;
    }
    const Expr extent = handle.defined() ? handle.dim(d).extent() : Expr(image.extent(d));
    const Expr found = inside(coordinate(at, d), at.all, extent);
    const int min = image.dim(d).min();
    place.push_back(min == 0 ? found : found + min);
  }
  if (!is_bounded) return handle.defined() ? handle(place) : image(place);
  const Type type = oracle::type_of_buffer(*image.raw_buffer());
  const Expr exterior = cast(type, Expr(0.5f));
  const int kind = c_.below(5);
  return (handle.defined() ? bounded(kind, exterior, handle)
                           : bounded(kind, exterior, image))(place);
}

Expr Maker::coordinate(const Point& at, int d) {
  if (at.all.empty()) return Expr(c_.between(0, 3));
  if (d < static_cast<int>(at.all.size()) && !c_.chance(25)) return at.all[static_cast<size_t>(d)];
  return at.all[static_cast<size_t>(c_.below(static_cast<int>(at.all.size())))];
}

// An index near the coordinate; or a data-dependent one, within a box.
Expr Maker::place(const Point& at, int d) {
  if (!s_.has_integers || !at.may_reduce || !c_.chance(6)) return near(coordinate(at, d), at.all);
  Point flat = at;
  flat.may_reduce = false;  // no reduction inside of the index
  const int low = c_.around_zero(3);
  return clamp(value(Int(32), flat, 1), low, low + c_.between(0, 12));
}

// Returns a Func, the last one with a higher probability.
const Func& Maker::any_func() {
  const int n = static_cast<int>(p_.funcs.size());
  if (s_.has_integers && c_.chance(50)) return p_.funcs.back();
  return p_.funcs[static_cast<size_t>(c_.below(n))];
}

Expr Maker::any_value(const FuncRef& ref) {
  return ref.element(c_.below(static_cast<int>(ref.size())));
}

Expr Maker::read_func(const Point& at) {
  if (p_.funcs.empty()) return read_image(at);
  const Func& f = any_func();
  const auto i = static_cast<size_t>(&f - p_.funcs.data());
  if (reads_ + inlined_reads_[i] > s_.reads) return read_image(at);
  reads_ += inlined_reads_[i];
  std::vector<Expr> place;
  for (int d = 0; d < f.dimensions(); ++d) place.push_back(this->place(at, d));
  return any_value(f(place));
}

// Reads the Func that is being updated, at the element written or elsewhere; for outputs, one step back.
Expr Maker::read_self(const Point& at) {
  std::vector<Expr> place = at.write;
  const bool elsewhere = c_.chance(60);
  for (size_t d = 0; d < place.size() && elsewhere; ++d) {
    if (at.is_pure[d]) continue;
    place[d] =
        is_output_ ? place[d] - 1 : near(c_.chance(30) ? coordinate(at, int(d)) : place[d], at.all);
  }
  return any_value(at.self(place));
}

}  // namespace retrograde::fuzz
