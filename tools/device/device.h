// device.h -- finds the GPU by asking CUDA's driver directly, without using our runtime.
#pragma once

#include <string>

namespace device_check {

struct Device {
  std::string name;
  int capability = 0;      // 90 means 9.0
  int driver_version = 0;  // 12040 means CUDA 12.4
  std::string why_none;    // empty if there is a device
};

Device find_device();

}  // namespace device_check
