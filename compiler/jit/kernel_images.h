// kernel_images.h -- keeps machine code of kernels in the compile cache between runs of a program. ptxas makes it from
// PTX for one chip. Without a cache folder or without ptxas there is none, and the driver compiles the PTX.
#pragma once

#include <optional>
#include <string>

namespace retrograde::jit {

// Returns the cached image for this text, chip (90 means compute capability 9.0) and driver version, or assembles and
// caches it. Nothing if there is no cache or no ptxas.
std::optional<std::string> kernel_image(const std::string& ptx, int capability, int driver_version);

// Makes the runtime ask for such images before it loads kernels of functions compiled here.
void offer_kernel_images();

}  // namespace retrograde::jit
