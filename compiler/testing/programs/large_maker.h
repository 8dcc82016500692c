// large_maker.h -- the generator of large programs.
//
// large.cpp: sizes, images, the order of pieces. large_images.cpp: maps from images to images. large_sums.cpp: sums and
// scatters.
#pragma once

#include "frontend/language/boundary_conditions.h"
#include "testing/programs/large.h"

namespace retrograde::fuzz {

struct LargeSize {
  int width, height, planes;
};

class LargeMaker {
 public:
  LargeMaker(Choices& choices, RandomProgram& program, LargeSizes sizes)
      : c_(choices), p_(program), sizes_(sizes) {}
  void run();

 private:
  struct Image {  // has values at [0, width) x [0, height) x [0, planes)
    Func f;
    int width = 0, height = 0, planes = 0;
    double elements() const { return double(width) * height * planes; }
  };
  using Piece = Image (LargeMaker::*)(const Image& a);

  // ---- large.cpp ----
  Image of_size(const LargeSize& size) const;
  void begin(const LargeSize& size);
  Piece begin_with_theme();
  void add_piece();
  void add(const Image& image);
  void end_with(const Image& last);
  // A new input image, by which the gradient is requested, too: a Buffer, or an ImageParam with estimates that are
  // right, wrong or missing.
  Func input(int width, int height, int planes);
  void estimate_wrongly(ImageParam& handle, const std::vector<int>& sizes);
  Func named(const char* name) { return Func(name + std::to_string(p_.funcs.size())); }
  Func kept(const Func& f) {
    p_.funcs.push_back(f);
    return f;
  }
  // Takes operations from the budget; false if it is exhausted.
  bool affords(double operations) { return (work_ += operations) < most_work; }
  // An input in steps of 1/1000 from -1 to 1, from which a program computes indices and branches.
  Func steps(const Image& like) { return input(like.width, like.height, like.planes); }
  static Expr bin_of(const Expr& step) {
    return clamp(cast<int>(floor(step * 7.77f + 8.013f)), 0, 15);
  }

  // ---- large_images.cpp ----
  Image pointwise(const Image& a);
  Image stencil(const Image& a);
  Image border(const Image& a);
  Image chain(const Image& a);
  Image transposed(const Image& a);
  Image halved(const Image& a);
  Image doubled(const Image& a);
  Image looked_up(const Image& a);
  Image warped(const Image& a);
  Image best_plane(const Image& a);
  Image mixed(const Image& a);
  Image copied_body(const Image& a);

  // ---- large_sums.cpp ----
  Image planes_mixed(const Image& a);
  Image convolved(const Image& a);
  Image multiplied(const Image& a);
  Image row_scan(const Image& a);
  Image column_scan(const Image& a);
  Image filtered_twice(const Image& a);
  Image levelled(const Image& a);
  Image splatted(const Image& a);
  Image centred(const Image& a);
  Image normalised(const Image& a);
  Image patched(const Image& a);
  Image paired(const Image& a);
  Image partly_summed(const Image& a);
  Image summed_over_planes(const Image& a);
  Image summed_twice(const Image& a);

  static constexpr double most_work = 2e8;
  const Var x{"x"}, y{"y"}, c{"c"};
  Choices& c_;
  RandomProgram& p_;
  const LargeSizes sizes_;
  double work_ = 0;
  std::vector<Image> images_;
};

}  // namespace retrograde::fuzz
