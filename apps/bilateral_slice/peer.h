// peer.h -- the program's side of the Halide peer.
#pragma once

#include <memory>
#include <vector>

#include "common/process.h"
#include "peer_protocol.h"
#include "shape.h"

namespace bilateral_slice {

class Peer {
 public:
  // Path of the installed peer; empty if it is not installed.
  static std::filesystem::path find();

  // Starts the peer and compiles its pipeline. Throws retrograde::UserError if the peer fails.
  Peer(const std::filesystem::path& program, const Shape& shape, const std::vector<float>& photo,
       const std::vector<float>& target, int threads);

  // Takes one step for each rate. Throws retrograde::UserError if the peer fails.
  std::vector<PeerStep> run(const std::vector<float>& rates);

  double compile_seconds() const { return compile_seconds_; }

 private:
  apps::Child child_;
  double compile_seconds_ = 0;
};

}  // namespace bilateral_slice
