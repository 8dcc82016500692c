#include "jit/kernel_images.h"

#include "gpu/assembler.h"
#include "jit/disk_cache.h"
#include "jit/ptxas.h"

namespace retrograde::jit {
namespace {

constexpr const char* kind = "cubin";

void offer(const retrograde_assembler_request* request,
           void (*use)(void* closure, const void* code, size_t bytes), void* closure) {
  try {
    const std::optional<std::string> image = kernel_image(
        {request->ptx, request->ptx_bytes}, request->capability, request->driver_version);
    if (image) use(closure, image->data(), image->size());
  } catch (...) {  // no usable cache folder, or no memory: the driver compiles the kernel
  }
}

}  // namespace

std::optional<std::string> kernel_image(const std::string& ptx, int capability,
                                        int driver_version) {
  const std::shared_ptr<DiskCache> disk = disk_cache();
  if (!disk) return std::nullopt;
  const std::string key =
      content_key({kind, std::to_string(capability), std::to_string(driver_version), ptx});
  if (const auto found = disk->find(key); found && found->function == kind)
    return std::string(found->object.begin(), found->object.end());
  const std::string program = find_ptxas();
  if (program.empty()) return std::nullopt;
  const Assembly made = assemble(program, ptx, capability);
  if (made.image.empty()) return std::nullopt;
  disk->insert(key, {kind, {made.image.begin(), made.image.end()}});
  return made.image;
}

void offer_kernel_images() {
  static const bool once = [] {
    retrograde_set_assembler(offer, 0);
    return true;
  }();
  (void)once;
}

}  // namespace retrograde::jit
