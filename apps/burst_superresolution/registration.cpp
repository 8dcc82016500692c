// registration.cpp -- see registration.h. The only file that uses OpenCV.
#include "registration.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <vector>

#include "diagnostics/error.h"

namespace burst {

struct Registration::Features {
  std::vector<cv::KeyPoint> points;
  cv::Mat descriptors;
};

namespace {

constexpr float best_over_second = 0.75f;  // Lowe, section 7.1, uses 0.8
constexpr double inlier_pixels = 1.5;
constexpr int least_inliers = 12;  // three times the number that determines a homography

// Turns OpenCV's exceptions into ours.
template <typename Work>
auto with_opencv(const Work& work) {
  try {
    return work();
  } catch (const cv::Exception& error) {
    retrograde::call_error("align the frames", "OpenCV must find features in them", error.err,
                           "Give other frames");
  }
}

// Lightness with 8 bits, as SIFT requires.
cv::Mat gray_of(std::span<const float> planes, const FrameSize& size) {
  cv::Mat gray(size.height, size.width, CV_8UC1);
  size_t at = 0;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x, ++at) {
      const float light = 0.25f * planes[at] + 0.5f * planes[size.pixels() + at] +
                          0.25f * planes[2 * size.pixels() + at];
      gray.at<uchar>(y, x) = cv::saturate_cast<uchar>(255 * light);
    }
  }
  return gray;
}

struct Pairs {
  std::vector<cv::Point2f> from, to;
};

template <typename Features>
Pairs pairs_of(const Features& frame, const Features& first) {
  Pairs pairs;
  if (frame.points.size() < 2 || first.points.size() < 2) return pairs;
  std::vector<std::vector<cv::DMatch>> matches;
  cv::BFMatcher(cv::NORM_L2).knnMatch(frame.descriptors, first.descriptors, matches, 2);
  for (const auto& m : matches) {
    if (m.size() < 2 || m[0].distance > best_over_second * m[1].distance) continue;
    pairs.from.push_back(frame.points[static_cast<size_t>(m[0].queryIdx)].pt);
    pairs.to.push_back(first.points[static_cast<size_t>(m[0].trainIdx)].pt);
  }
  return pairs;
}

std::optional<Homography> fitted(const Pairs& pairs, const FrameSize& size) {
  if (pairs.from.size() < static_cast<size_t>(least_inliers)) return {};
  cv::Mat inliers;
  const cv::Mat found =
      cv::findHomography(pairs.from, pairs.to, cv::RANSAC, inlier_pixels, inliers);
  if (found.empty() || cv::countNonZero(inliers) < least_inliers) return {};
  Matrix matrix{};
  std::copy_n(found.ptr<double>(), matrix.size(), matrix.begin());
  const Homography h = homography_of(matrix, size);
  if (!is_small_motion(h, size)) return {};
  return h;
}

}  // namespace

Registration::Registration(std::span<const float> first, const FrameSize& size)
    : size_(size), first_(std::make_unique<Features>()) {
  with_opencv([&] {
    cv::SIFT::create()->detectAndCompute(gray_of(first, size), cv::noArray(), first_->points,
                                         first_->descriptors);
  });
}

Registration::~Registration() = default;

std::optional<Homography> Registration::motion_of(std::span<const float> frame) const {
  return with_opencv([&] {
    Features own;
    cv::SIFT::create()->detectAndCompute(gray_of(frame, size_), cv::noArray(), own.points,
                                         own.descriptors);
    return fitted(pairs_of(own, *first_), size_);
  });
}

}  // namespace burst
