// kernel_images.h -- machine code of kernels, kept in the compile cache from one run of a program to the
// next: what ptxas makes of PTX for a chip. Without a cache folder or without ptxas there is none, and the
// driver compiles.
#pragma once

#include <optional>
#include <string>

namespace retrograde::jit {

// Of the cache's entry for this text, chip (90: compute capability 9.0) and version of the driver; else
// assembled now, and kept.
std::optional<std::string> kernel_image(const std::string& ptx, int capability, int driver_version);

// The runtime asks for such images before it loads kernels of functions that were compiled here.
void offer_kernel_images();

}  // namespace retrograde::jit
