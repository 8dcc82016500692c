// outcome.h -- what a program gave on a device, as a record of its bytes, or of why there are none.
#pragma once

#include <functional>
#include <string>

#include "records.h"
#include "retrograde/retrograde.h"

namespace device_check {

// Of all elements, fetched from the device; every NaN as the same one, since which it is, nobody says.
std::string bytes_of(retrograde::Buffer<>& buffer);

// What is refused is refused for every device; what fails may fail on one.
Record recorded(const std::string& name, const std::function<std::string()>& compute);

}  // namespace device_check
