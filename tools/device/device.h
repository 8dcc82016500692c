// device.h -- which device there is, asked of CUDA's driver itself: nothing of ours stands between.
#pragma once

#include <string>

namespace device_check {

struct Device {
  std::string name;
  int capability = 0;      // 90: 9.0
  int driver_version = 0;  // 12040: of CUDA 12.4
  std::string why_none;    // not empty: there is no device
};

Device find_device();

}  // namespace device_check
