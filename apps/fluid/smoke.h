// smoke.h -- densities as pictures, and pictures as densities.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/images.h"

namespace fluid {

// How much smoke there is in each cell: the picture's luminance.
struct Smoke {
  int width = 0, height = 0;
  std::vector<float> density;  // [height, width]

  double total() const;
};

// A cell for each pixel. Throws retrograde::UserError for pictures that cannot be read.
Smoke read_smoke(const std::filesystem::path& path);
// A picture of the same shape as another one, with its cells.
Smoke read_smoke_like(const std::filesystem::path& path, const Smoke& other);

struct Cells {
  int width, height;
};
// Of a box in the shape of the picture of this name: `longer` along its longer side, or the picture's
// pixels where it is 0. Throws retrograde::UserError where they are fewer than 4 x 4.
Cells cells_for(const Smoke& picture, int longer, const std::filesystem::path& path);

// The means over the areas of the new cells.
Smoke resample(const Smoke& smoke, int width, int height);

// A disc in the middle with as much smoke as `other`, of density 1 where it fits into the box, and
// without sharp edges.
Smoke disc_like(const Smoke& other);

// Gray, each cell as zoom x zoom pixels.
apps::Image to_image(const Smoke& smoke, int zoom);
// Side by side, with a line between them.
apps::Image strip_of(const std::vector<apps::Image>& images);

// A GIF of so many images of one size, shown one after the other. It goes into a scratch file, since
// OpenImageIO writes this format by name only; finish() gives it its place, whole or not at all.
class Animation {
 public:
  Animation(int images, int frames_a_second);
  ~Animation();
  Animation(const Animation&) = delete;
  Animation& operator=(const Animation&) = delete;

  // Both throw retrograde::UserError.
  void add(const apps::Image& image);
  void finish(const std::filesystem::path& path);

 private:
  [[noreturn]] void refuse(const std::string& evidence) const;

  struct Encoder;
  std::unique_ptr<Encoder> encoder_;
};

}  // namespace fluid
