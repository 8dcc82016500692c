#include "testing/programs/large.h"

#include <algorithm>

#include "testing/programs/large_maker.h"

namespace retrograde::fuzz {

namespace {

// Dimensions of one element, rows longer than any block, planes beyond the caches (16 MB).
constexpr LargeSize full_sizes[] = {
    {700, 500, 1},  {100000, 1, 1},  {257, 129, 3},  {350, 250, 16}, {96, 64, 32},   {1, 700, 3},
    {1, 1, 1},      {96, 64, 32},    {120, 90, 24},  {130, 100, 8},  {33, 1, 2000},  {64, 64, 4},
    {1200, 900, 1}, {20, 1000, 5},   {1000, 20, 16}, {1, 1, 5000},   {512, 300, 32}, {360, 250, 48},
    {256, 300, 64}, {2200, 2000, 1}, {512, 300, 32}};

// An odd extent, longer than a vector in the first dimension.
constexpr int small_side(int full, int most) { return full <= 5 ? full : most - full % 7; }

}  // namespace

LargeMaker::Image LargeMaker::of_size(const LargeSize& size) const {
  if (sizes_ == LargeSizes::Full) return {Func(), size.width, size.height, size.planes};
  return {Func(), small_side(size.width, 41), small_side(size.height, 13),
          small_side(size.planes, 11)};
}

void LargeMaker::estimate_wrongly(ImageParam& handle, const std::vector<int>& sizes) {
  const int how = c_.below(4);
  if (how == 0) return;  // no estimates
  for (size_t d = 0; d < sizes.size(); ++d) {
    const int estimate = how == 1 ? sizes[d] : how == 2 ? 2 * sizes[d] : std::max(1, sizes[d] / 50);
    handle.dim(static_cast<int>(d)).set_estimate(0, estimate);
  }
}

Func LargeMaker::input(int width, int height, int planes) {
  Buffer<float> image(std::vector<int>{width, height, planes},
                      "image" + std::to_string(p_.images.size()));
  const int salt = 31 * static_cast<int>(p_.images.size());
  image.for_each_element([&](int i, int j, int k) {
    const unsigned step = static_cast<unsigned>(i) * 7919u + static_cast<unsigned>(j) * 104729u +
                          static_cast<unsigned>(k + salt) * 1299709u;
    image(i, j, k) = static_cast<float>((step ^ step >> 7) % 2003) / 1000.0f - 1.0f;
  });
  p_.images.push_back(image);
  ImageParam handle;
  if (c_.chance(35)) {
    handle = ImageParam(Float(32), 3, image.name() + "_given");
    handle.set(image);
    estimate_wrongly(handle, {width, height, planes});
  }
  p_.handles.push_back(handle);
  Func source = named("source");
  source(x, y, c) = handle.defined() ? Expr(handle(x, y, c)) : Expr(image(x, y, c));
  return kept(source);
}

void LargeMaker::add_piece() {
  using Maker = LargeMaker;
  // Pieces to which few rules apply occur more often.
  static constexpr Piece pieces[] = {
      &Maker::pointwise,      &Maker::stencil,       &Maker::border,
      &Maker::chain,          &Maker::transposed,    &Maker::halved,
      &Maker::doubled,        &Maker::looked_up,     &Maker::warped,
      &Maker::warped,         &Maker::best_plane,    &Maker::mixed,
      &Maker::copied_body,    &Maker::convolved,     &Maker::multiplied,
      &Maker::multiplied,     &Maker::row_scan,      &Maker::column_scan,
      &Maker::levelled,       &Maker::splatted,      &Maker::splatted,
      &Maker::centred,        &Maker::normalised,    &Maker::planes_mixed,
      &Maker::filtered_twice, &Maker::patched,       &Maker::patched,
      &Maker::filtered_twice, &Maker::summed_twice,  &Maker::chain,
      &Maker::summed_twice,   &Maker::partly_summed, &Maker::summed_over_planes,
      &Maker::paired,         &Maker::paired,        &Maker::filtered_twice,
      &Maker::multiplied};
  add((this->*pieces[c_.below(static_cast<int>(std::size(pieces)))])(images_.back()));
}

void LargeMaker::add(const Image& image) {
  if (!image.f.defined()) return;
  kept(image.f);
  images_.push_back(image);
}

// Ends with the image, or with a loss of it: one or two numbers. The terms of a loss do not cancel, because its
// rounding errors would be as large as its value.
void LargeMaker::end_with(const Image& last) {
  const int how = c_.below(4);
  oracle::Region region{{0, 0, 0}, {last.width, last.height, last.planes}};
  if (how == 0) {
    p_.outputs = {last.f};
    p_.runs = {{region}};
    return;
  }
  Func output = named(how < 2 ? "output" : "loss");
  if (how < 2) {
    output(x, y, c) = last.f(x, y, c) * p_.scale;
  } else {
    const RDom r(0, last.width, 0, last.height, 0, last.planes);
    const Expr v = last.f(r.x, r.y, r.z);
    if (how == 2) {
      output() = 0.0f;
      output() += v * v * p_.scale;
    } else {
      output() = Tuple(0.0f, 0.0f);
      output() = Tuple(output()[0] + sqrt(v * v + 0.25f), output()[1] + v * v * p_.scale);
    }
    region = {};
  }
  p_.outputs = {kept(output)};
  p_.runs = {{region}};
}

// Begins with a piece to which few rules apply, at a size for which they apply.
LargeMaker::Piece LargeMaker::begin_with_theme() {
  struct Theme {
    Piece piece;
    LargeSize size;
  };
  static constexpr Theme themes[] = {
      {&LargeMaker::filtered_twice, {1200, 900, 1}}, {&LargeMaker::filtered_twice, {350, 250, 16}},
      {&LargeMaker::multiplied, {96, 64, 32}},       {&LargeMaker::multiplied, {130, 100, 16}},
      {&LargeMaker::splatted, {256, 300, 64}},       {&LargeMaker::warped, {512, 300, 32}},
      {&LargeMaker::paired, {640, 1100, 1}},         {&LargeMaker::paired, {210, 140, 24}},
      {&LargeMaker::summed_twice, {350, 250, 16}},   {&LargeMaker::convolved, {130, 100, 8}}};
  const Theme& theme = themes[c_.below(static_cast<int>(std::size(themes)))];
  begin(theme.size);
  return theme.piece;
}

void LargeMaker::begin(const LargeSize& size) {
  Image first = of_size(size);
  first.f = input(first.width, first.height, first.planes);
  images_.push_back(first);
}

void LargeMaker::run() {
  p_.scale.set(0.75f);
  int more = c_.between(1, 3);
  if (c_.chance(40)) {
    const Piece piece = begin_with_theme();
    add((this->*piece)(images_.back()));
    more = c_.chance(60) ? 0 : 1;
  } else {
    begin(full_sizes[c_.below(static_cast<int>(std::size(full_sizes)))]);
  }
  for (; more > 0; --more) add_piece();
  end_with(images_.back());
}

RandomProgram make_large_program(Choices& choices, LargeSizes sizes) {
  RandomProgram program;
  LargeMaker(choices, program, sizes).run();
  return program;
}

}  // namespace retrograde::fuzz
