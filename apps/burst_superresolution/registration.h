// registration.h -- where the homographies start: features of a frame that are found again in the first one.
//
// SIFT (D. Lowe, Distinctive image features from scale-invariant keypoints, International Journal of Computer
// Vision 60 (2), 2004), nearest neighbours by his ratio of distances, and RANSAC (M. Fischler, R. Bolles, Random
// sample consensus, Communications of the ACM 24 (6), 1981), all as OpenCV has them.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "homography.h"

namespace burst {

class Registration {
 public:
  // first: planes [3, height, width], demosaicked. Throws retrograde::UserError.
  Registration(std::span<const float> first, const FrameSize& size);
  ~Registration();
  Registration(const Registration&) = delete;
  Registration& operator=(const Registration&) = delete;

  // Of another frame, demosaicked; nothing where too few features are found again, or their motion is none of a
  // shaken camera. The same for the same frames. Throws retrograde::UserError.
  std::optional<Homography> motion_of(std::span<const float> frame) const;

 private:
  struct Features;
  FrameSize size_;
  std::unique_ptr<Features> first_;
};

}  // namespace burst
