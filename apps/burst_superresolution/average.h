// average.h -- the plain way to use a burst, beside which ours is measured: every frame demosaicked by itself,
// laid over the first by bicubic interpolation, and all of them averaged.
#pragma once

#include <span>
#include <vector>

#include "homography.h"

namespace burst {

class BicubicAverage {
 public:
  explicit BicubicAverage(const FrameSize& size);

  // frame: planes [3, height, width]. The homography must be regular.
  void add(std::span<const float> frame, const Homography& homography);
  // The mean of the frames that see a pixel, [3, height, width]; one of them must see all, as the first does.
  std::vector<float> take() const;

 private:
  void add_row(std::span<const float> frame, const Homography& to_frame, int y);

  FrameSize size_;
  std::vector<float> sums_;  // [3, height, width]
  std::vector<int> counts_;  // [height, width]
};

}  // namespace burst
