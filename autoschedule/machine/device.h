// device.h -- the description of a GPU.
//
// The constants describe a small GPU. Schedules split sums for this device whatever the real one is, because the
// number of partial sums decides the bits of a result; a larger device runs them as fast as a small one does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace retrograde::planning {

struct Device {
  int multiprocessors = 16;
  int warp_size = 32;
  int threads = 2048;               // resident on a multiprocessor at most
  int registers = 65536;            // of 32 bits, of a multiprocessor
  int64_t shared_bytes = 48 << 10;  // of a block
  int64_t l2_bytes = 2 << 20;
  double bytes_per_ns = 200;  // bandwidth of device memory
  double l2_bytes_per_ns = 600, l1_bytes_per_ns = 1000;
  int64_t l1_bytes = 64 << 10;      // of a multiprocessor
  double operations_per_ns = 1500;  // sums and products of all multiprocessors
  // An iteration of a serial loop, whose loads and sums wait for those of the iteration before.
  double iteration_ns = 15;
  double launch_ns = 4000;

  // ---- Launches ----

  size_t grid_dimensions = 3;  // at most; a block has as many
  // Blocks along the second and third dimension of a grid, at most. The first may have 2^31 - 1.
  int64_t grid_blocks = 65535;
  // The threads of a block in a schedule: four warps.
  int64_t block_threads() const;

  // ---- Partial sums ----

  // The threads that keep the device busy.
  int64_t enough_threads() const;
  // A kernel of fewer threads leaves most of the device idle.
  int64_t few_threads() const;
  // The terms of a sum that are worth the launch of another kernel.
  int64_t launch_terms = 1 << 10;

  std::string to_string() const;  // one line
  friend bool operator==(const Device&, const Device&) = default;
};

}  // namespace retrograde::planning
