// peer.h -- the Halide peer, seen from the program.
#pragma once

#include <memory>
#include <vector>

#include "common/process.h"
#include "peer_protocol.h"
#include "shape.h"

namespace bilateral_slice {

class Peer {
 public:
  // Where the peer is installed, or empty when it is not.
  static std::filesystem::path find();

  // Compiles there. Throws retrograde::UserError when the peer fails.
  Peer(const std::filesystem::path& program, const Shape& shape, const std::vector<float>& photo,
       const std::vector<float>& target, int threads);

  // Takes one step for each rate. Throws retrograde::UserError when the peer fails.
  std::vector<PeerStep> run(const std::vector<float>& rates);

  double compile_seconds() const { return compile_seconds_; }

 private:
  apps::Child child_;
  double compile_seconds_ = 0;
};

}  // namespace bilateral_slice
