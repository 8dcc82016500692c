// average.h -- a simple baseline for using a burst: demosaic every frame by itself, align it to the first frame by
// bicubic interpolation, and average all frames.
#pragma once

#include <span>
#include <vector>

#include "homography.h"

namespace burst {

class BicubicAverage {
 public:
  explicit BicubicAverage(const FrameSize& size);

  // frame: planes [3, height, width]. The homography must be invertible.
  void add(std::span<const float> frame, const Homography& homography);
  // The mean over the frames that see a pixel, [3, height, width]. At least one frame, such as the first, must see
  // every pixel.
  std::vector<float> take() const;

 private:
  void add_row(std::span<const float> frame, const Homography& to_frame, int y);

  FrameSize size_;
  std::vector<float> sums_;  // [3, height, width]
  std::vector<int> counts_;  // [height, width]
};

}  // namespace burst
