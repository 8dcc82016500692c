// burst.h -- a burst: several frames of one scene from a shaking camera. All other parts work on it.
//
// Frames are mosaics R G over G B with sRGB-encoded samples, in which noise is about equally strong in dark and bright
// areas. The first frame defines the picture: its homography is always the identity.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "homography.h"

namespace burst {

// Smaller frames cannot be aligned.
inline constexpr int least_side = 16;

// The truth behind a simulated burst.
struct Truth {
  std::vector<float> planes;             // [3, height, width]
  std::vector<Homography> homographies;  // of each frame
  double noise = 0;                      // its standard deviation
  int border = 0;  // pixels at each side of the picture that some frame does not see
};

struct Burst {
  FrameSize size;
  int bits = 16;                   // of the files; for 32, results are also written as linear light
  int orientation = 1;             // how to turn the pictures, according to the first frame
  std::vector<float> samples;      // [frames, height, width]
  std::vector<std::string> names;  // file names of the frames
  std::vector<std::string> notes;  // notes for the user, such as frames left out
  std::optional<Truth> truth;

  int frames() const { return static_cast<int>(names.size()); }
  std::span<const float> frame(int n) const {
    return std::span(samples).subspan(static_cast<size_t>(n) * size.pixels(), size.pixels());
  }
  // Removes these frames; the first one must not be among them.
  void leave_out(const std::vector<int>& which);
};

// Reads the RAW files of a folder, or its images of one channel with `pattern` ("RGGB"), in the order of their names.
// All must have one size and pattern. Rows and columns before the first red sample are cut off. Throws
// retrograde::UserError.
Burst read_burst(const std::filesystem::path& folder, const std::string& pattern);

// Writes each frame as a mosaic with 16 bits per sample, frame_00.png and so on; read_burst reads them with "RGGB".
// Throws retrograde::UserError.
void write_frames(const std::filesystem::path& folder, const Burst& burst);

}  // namespace burst
