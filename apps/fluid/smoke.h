// smoke.h -- converts densities to pictures and back.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/images.h"

namespace fluid {

// The amount of smoke in each cell: the picture's luminance.
struct Smoke {
  int width = 0, height = 0;
  std::vector<float> density;  // [height, width]

  double total() const;
};

// One cell per pixel. Throws retrograde::UserError if the picture cannot be read.
Smoke read_smoke(const std::filesystem::path& path);
// Reads a picture that has the shape of `other`, with other's number of cells.
Smoke read_smoke_like(const std::filesystem::path& path, const Smoke& other);

struct Cells {
  int width, height;
};
// The cells of a box with the shape of the picture of this name: `longer` cells along its longer side, or one per pixel
// if it is 0. Throws retrograde::UserError if there are fewer than 4 x 4.
Cells cells_for(const Smoke& picture, int longer, const std::filesystem::path& path);

// Averages over the areas of the new cells.
Smoke resample(const Smoke& smoke, int width, int height);

// A disc in the middle with as much smoke as `other`, of density 1 if it fits into the box, and with soft edges.
Smoke disc_like(const Smoke& other);

// Gray; each cell becomes zoom x zoom pixels.
apps::Image to_image(const Smoke& smoke, int zoom);
// Images side by side, with a line between them.
apps::Image strip_of(const std::vector<apps::Image>& images);

// Writes a GIF of `images` images of one size. It is written to a temporary file, because OpenImageIO writes this
// format only by name; finish() moves it to its destination atomically.
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
