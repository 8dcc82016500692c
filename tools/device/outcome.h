// outcome.h -- records a program's result on a device: its bytes, or why there are none.
#pragma once

#include <functional>
#include <string>

#include "records.h"
#include "retrograde/retrograde.h"

namespace device_check {

// The bytes of all elements, copied from the device. All NaNs become the same, because the bits of a NaN are
// unspecified.
std::string bytes_of(retrograde::Buffer<>& buffer);

// A program that is refused is refused on every device; one that fails may fail on one device only.
Record recorded(const std::string& name, const std::function<std::string()>& compute);

}  // namespace device_check
