// peer.cpp -- see peer.h.
#include "peer.h"

#include <string>

#include "diagnostics/error.h"

namespace bilateral_slice {

namespace {

constexpr const char* name = "bilateral_slice_halide_peer";

void require(bool alive) {
  if (alive) return;
  retrograde::call_error("measure Halide 14",
                         "its peer program must answer until it is told to end",
                         std::string(name) + " ended early; its own message is above",
                         "Run again with --halide-seconds 0 to leave it out");
}

}  // namespace

std::filesystem::path Peer::find() {
  const auto here = apps::program_folder();
  for (const auto& place : {here / ".." / "libexec" / "retrograde" / name, here / name}) {
    if (std::filesystem::exists(place)) return place;
  }
  return {};
}

Peer::Peer(const std::filesystem::path& program, const Shape& shape,
           const std::vector<float>& photo, const std::vector<float>& target, int threads)
    : child_(program, {}, {{"HL_NUM_THREADS", std::to_string(threads)}}) {
  const PeerJob job{shape.width, shape.height, shape.channels, shape.grid_x, shape.grid_y, threads};
  require(child_.send(&job, sizeof job) &&
          child_.send(photo.data(), photo.size() * sizeof(float)) &&
          child_.send(target.data(), target.size() * sizeof(float)));
  PeerReady ready;
  require(child_.receive(&ready, sizeof ready));
  compile_seconds_ = ready.compile_seconds;
}

std::vector<PeerStep> Peer::run(const std::vector<float>& rates) {
  const auto count = static_cast<int32_t>(rates.size());
  require(child_.send(&count, sizeof count) &&
          child_.send(rates.data(), rates.size() * sizeof(float)));
  std::vector<PeerStep> steps(rates.size());
  for (PeerStep& step : steps) require(child_.receive(&step, sizeof step));
  return steps;
}

}  // namespace bilateral_slice
