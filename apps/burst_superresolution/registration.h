// registration.h -- estimates the initial homographies from features of a frame that are also found in the first frame.
//
// Uses SIFT (D. Lowe, Distinctive image features from scale-invariant keypoints, International Journal of Computer
// Vision 60 (2), 2004), nearest neighbours by Lowe's ratio of distances, and RANSAC (M. Fischler, R. Bolles, Random
// sample consensus, Communications of the ACM 24 (6), 1981), all as implemented by OpenCV.
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

  // The homography of another frame, demosaicked. Nothing if too few features match, or if the motion is implausible
  // for a shaking camera. Deterministic for the same frames. Throws retrograde::UserError.
  std::optional<Homography> motion_of(std::span<const float> frame) const;

 private:
  struct Features;
  FrameSize size_;
  std::unique_ptr<Features> first_;
};

}  // namespace burst
