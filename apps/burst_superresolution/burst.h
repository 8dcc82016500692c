// burst.h -- frames of one scene by a camera that shook: what everything else works on.
//
// Frames are mosaics R G over G B with samples in sRGB's encoding, in which noise is about as strong in the
// dark as in the light. The first one defines the picture: its homography is the identity and stays so.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "homography.h"

namespace burst {

// Below this a frame has nothing to align by.
inline constexpr int least_side = 16;

// What a simulated burst was made of.
struct Truth {
  std::vector<float> planes;             // [3, height, width]
  std::vector<Homography> homographies;  // of each frame
  double noise = 0;                      // its standard deviation
  int border = 0;  // pixels at each side of the picture that not every frame sees
};

struct Burst {
  FrameSize size;
  int bits = 16;                   // of the files; 32: results are written as linear light, too
  int orientation = 1;             // how pictures are to be turned, as the first frame says
  std::vector<float> samples;      // [frames, height, width]
  std::vector<std::string> names;  // of the frames
  std::vector<std::string> notes;  // what a person should know: frames left out ...
  std::optional<Truth> truth;

  int frames() const { return static_cast<int>(names.size()); }
  std::span<const float> frame(int n) const {
    return std::span(samples).subspan(static_cast<size_t>(n) * size.pixels(), size.pixels());
  }
  // Without these frames, of which none is the first.
  void leave_out(const std::vector<int>& which);
};

// The RAW files of a folder, or its images of one channel with `pattern` ("RGGB"), by their names' order; all
// of one size and pattern. What precedes the first red sample is cut off. Throws retrograde::UserError.
Burst read_burst(const std::filesystem::path& folder, const std::string& pattern);

// Each frame as a mosaic with 16 bits a sample, frame_00.png and so on: read_burst reads them with "RGGB". Throws
// retrograde::UserError.
void write_frames(const std::filesystem::path& folder, const Burst& burst);

}  // namespace burst
