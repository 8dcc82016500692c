// gradient_local_laplacian -- local Laplacian filters with 8 levels and 4 greys (Paris, Hasinoff and Kautz 2011), each
// level with a gain. Gradients: picture and gains.
#include "pyramid.h"

namespace {

struct GradientLocalLaplacian : programs::GradientGenerator<GradientLocalLaplacian> {
  Variable picture{"image", "picture", {512, 384}}, gain{"detail", "gain", {8}};
  Seed seed{{512, 384}};

  void generate() {
    programs::Pyramid pyramid;
    const int levels = 8, greys = 4;
    std::vector<Func> remapped(levels), own(levels);
    std::vector<std::vector<int>> size = {{512, 384, greys}};
    Expr difference = picture(x, y) - cast<float>(c) / (greys - 1);
    remapped[0](x, y, c) = picture(x, y) + 0.5f * difference * exp(-4.0f * difference * difference);
    own[0](x, y, c) = picture(x, y);
    pyramid.stages.push_back(remapped[0]);
    for (int j = 1; j < levels; j++) {
      remapped[j] = pyramid.smaller(remapped[j - 1], size[j - 1], "remapped_" + std::to_string(j));
      own[j] = pyramid.smaller(own[j - 1], {size[j - 1][0], size[j - 1][1], 1},
                               "own_" + std::to_string(j));
      size.push_back({programs::half(size[j - 1][0]), programs::half(size[j - 1][1]), greys});
    }
    Func result;
    for (int j = levels - 1; j >= 0; j--) {
      const std::string number = std::to_string(j);
      Expr place = clamp(own[j](x, y, 0), 0.0f, 1.0f) * (greys - 1);
      Expr low = clamp(cast<int>(place), 0, greys - 2), share = place - cast<float>(low);
      Func band("band_" + number), mixed("mixed_" + number);
      Expr detail_of = remapped[j](x, y, c);
      if (j < levels - 1)
        detail_of -= pyramid.larger(remapped[j + 1], size[j + 1], "base_" + number)(x, y, c);
      band(x, y, c) = detail_of;
      Expr value = gain(j) * lerp(band(x, y, low), band(x, y, low + 1), share);
      if (j < levels - 1)
        value +=
            pyramid.larger(result, {size[j + 1][0], size[j + 1][1], 1}, "up_" + number)(x, y, 0);
      mixed(x, y, c) = value;
      pyramid.stages.insert(pyramid.stages.end(), {band, mixed});
      result = mixed;
    }
    Func grey("grey");
    grey(x, y) = result(x, y, 0);
    store(pyramid.stages);
    differentiate(grey, seed, {&picture, &gain});
  }
};

}  // namespace

PROGRAM(gradient_local_laplacian, GradientLocalLaplacian,
        gradients_of({in<float>({512, 384}), in<float>({8}, 0.5, 1.5).noise()}, {512, 384}))
