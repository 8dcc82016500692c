// burst.cpp -- see burst.h.
#include "burst.h"

#include <algorithm>
#include <cstdio>

#include "common/files.h"
#include "common/images.h"
#include "demosaic/sensor.h"
#include "diagnostics/error.h"

namespace burst {

using retrograde::quoted;
using retrograde::text;

namespace {

// A sensor's samples from the first red one on, with an even number of rows and columns.
struct Frame {
  FrameSize size;
  int bits = 16;
  std::vector<float> samples;
};

// `sensor` begins with red because a mirrored row or column was put before it; this frame begins with the next red
// sample, which was measured.
Frame measured(const demosaic::Sensor& sensor) {
  const int left = 2 * sensor.left, top = 2 * sensor.top;
  Frame frame{{(sensor.width - left) / 2 * 2, (sensor.height - top) / 2 * 2}, sensor.bits, {}};
  for (int y = top; y < top + frame.size.height; ++y) {
    const auto row = sensor.samples.begin() + static_cast<long>(y) * sensor.width + left;
    frame.samples.insert(frame.samples.end(), row, row + frame.size.width);
  }
  return frame;
}

void require_large(const std::filesystem::path& path, const FrameSize& size) {
  if (size.width >= least_side && size.height >= least_side) return;
  retrograde::call_error(
      text("use the frame ", quoted(path.string())),
      text("a frame needs ", least_side, " x ", least_side, " samples from its first red one on"),
      text("it has ", size.width, " x ", size.height), "Give larger frames");
}

void require_same_size(const std::filesystem::path& path, const FrameSize& size,
                       const FrameSize& first) {
  if (size.width == first.width && size.height == first.height) return;
  retrograde::call_error(text("use the frame ", quoted(path.string())),
                         "all frames of a burst are of one size",
                         text("it has ", size.width, " x ", size.height, " samples, the first ",
                              first.width, " x ", first.height),
                         "Give the frames of one camera, held the same way");
}

}  // namespace

void Burst::leave_out(const std::vector<int>& which) {
  Burst kept = *this;
  kept.samples.clear();
  kept.names.clear();
  if (kept.truth) kept.truth->homographies.clear();
  for (int n = 0; n < frames(); ++n) {
    if (std::find(which.begin(), which.end(), n) != which.end()) continue;
    const auto own = frame(n);
    kept.samples.insert(kept.samples.end(), own.begin(), own.end());
    kept.names.push_back(names[static_cast<size_t>(n)]);
    if (truth) kept.truth->homographies.push_back(truth->homographies[static_cast<size_t>(n)]);
  }
  *this = std::move(kept);
}

Burst read_burst(const std::filesystem::path& folder, const std::string& pattern) {
  Burst burst;
  for (const std::filesystem::path& path : apps::images_in(folder)) {
    const demosaic::Sensor sensor = demosaic::read_sensor(path, pattern);
    const Frame frame = measured(sensor);
    require_large(path, frame.size);
    if (burst.names.empty()) {
      burst.size = frame.size;
      burst.bits = frame.bits;
      burst.orientation = sensor.orientation;
    }
    require_same_size(path, frame.size, burst.size);
    burst.samples.insert(burst.samples.end(), frame.samples.begin(), frame.samples.end());
    burst.names.push_back(path.filename().string());
  }
  return burst;
}

void write_frames(const std::filesystem::path& folder, const Burst& burst) {
  apps::require_writable_folder(folder);
  for (int n = 0; n < burst.frames(); ++n) {
    char name[32];
    std::snprintf(name, sizeof name, "frame_%02d.png", n);
    const auto samples = burst.frame(n);
    apps::write_image(
        folder / name,
        {burst.size.width, burst.size.height, 16, {samples.begin(), samples.end()}, 1});
  }
}

}  // namespace burst
