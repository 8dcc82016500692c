// The pool of device memory.
#include "gpu/device_memory.h"

#include <algorithm>
#include <atomic>
#include <iterator>

#include "gpu/gpu_calls.h"
#include "gpu/host.h"

namespace retrograde::runtime {
namespace {

constexpr size_t smallest_bytes = 512;

// There are eight sizes between consecutive powers of two: similar requests share blocks, and at most an eighth is
// wasted.
size_t size_class(size_t bytes) {
  if (bytes <= smallest_bytes) return smallest_bytes;
  size_t step = smallest_bytes;
  while (step * 16 < bytes) step *= 2;
  return (bytes + step - 1) / step * step;
}

std::atomic<retrograde_device_allocate_t> caller_allocate{nullptr};
std::atomic<retrograde_device_release_t> caller_release{nullptr};

void* user_context_of(const Request& request) {
  return request.caller ? request.caller->user_data : nullptr;
}

// ---- unused blocks of the pool ----

bool is_ready_for(const Block& block, Stream stream) {
  return block.uses == Block::Uses::none ||
         (block.uses == Block::Uses::one_stream && block.stream == stream);
}

// Prefers the newest block that can be used without waiting, because its memory is most likely cached. Otherwise
// returns one that requires waiting, unless the stream is being captured.
std::vector<Block>::iterator find_unused(DeviceState& device, size_t bytes, Stream stream,
                                         uint64_t capture) {
  auto found = device.unused.end();
  for (auto it = device.unused.begin(); it != device.unused.end(); ++it) {
    if (it->bytes != bytes || (it->capture != 0 && it->capture != capture)) continue;
    if (is_ready_for(*it, stream) || (found == device.unused.end() && capture == 0)) found = it;
  }
  return found;
}

void take_unused(DeviceState& device, std::vector<Block>::iterator it) {
  device.unused_bytes -= it->bytes;
  device.unused.erase(it);
}

void keep(Devices& known, const Block& block) {
  DeviceState& device = *block.device;
  device.unused.push_back(block);
  device.unused_bytes += block.bytes;
  known.live.erase(block.base);
}

// Makes a block of the pool live; base 0 if there is none. `must_wait`: whether the device must be waited for before
// use.
Block reuse(DeviceState& device, size_t bytes, Stream stream, uint64_t capture, bool& must_wait) {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  const auto found = find_unused(device, bytes, stream, capture);
  if (found == device.unused.end()) return {};
  Block block = *found;
  must_wait = !is_ready_for(block, stream);
  block.capture = capture;
  block.is_used_again = block.uses != Block::Uses::none;
  known.live.emplace(block.base, block);
  take_unused(device, found);
  return block;
}

// Call this after waiting for the device.
void forget_uses(Address base) {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  if (const auto found = known.live.find(base); found != known.live.end()) {
    found->second.uses = Block::Uses::none;
    found->second.is_used_again = false;
  }
}

int32_t reuse_block(const Session& session, size_t bytes, uint64_t capture, Address& base) {
  bool must_wait = false;
  const Block block = reuse(session.device(), bytes, session.stream(), capture, must_wait);
  if (!must_wait) {
    base = block.base;
    return 0;
  }
  if (const int32_t code = wait_for_device(session)) {
    return_block(block.base);
    return code;
  }
  forget_uses(block.base);
  base = block.base;
  return 0;
}

// ---- blocks from the driver ----

// Selects unused blocks to free. Blocks of a graph are in use whenever the graph is launched.
enum class Which { not_of_graphs, all };

bool pop_unused(DeviceState& device, size_t keep_bytes, Which which, Block& block) {
  const std::lock_guard lock(devices().mutex);
  if (device.unused_bytes <= keep_bytes) return false;
  const auto found = std::find_if(device.unused.begin(), device.unused.end(), [&](const Block& b) {
    return which == Which::all || b.capture == 0;
  });
  if (found == device.unused.end()) return false;
  block = *found;
  take_unused(device, found);
  return true;
}

void push_unused(const Block& block) {
  const std::lock_guard lock(devices().mutex);
  block.device->unused.insert(block.device->unused.begin(), block);
  block.device->unused_bytes += block.bytes;
}

// Frees the oldest blocks until at most `keep_bytes` are unused. cuMemFree waits for work that uses the memory.
int32_t shrink_unused(const Session& session, size_t keep_bytes, Which which) {
  Block block;
  while (pop_unused(session.device(), keep_bytes, which, block)) {
    const Result result = session.driver().cuMemFree_v2(block.base);
    if (loses_context(result)) continue;  // its memory is lost too
    if (result != success) {
      push_unused(block);
      return session.failed("cuMemFree_v2", result);
    }
  }
  return 0;
}

// During its lifetime, the calling thread may make calls that a graph capture otherwise forbids because the graph would
// have to repeat them. Allocations are safe: the memory stays for every launch.
class RelaxedCapture {
 public:
  RelaxedCapture(const Session& session, bool is_wanted) : session_(session) {
    if (is_wanted) result_ = session.driver().cuThreadExchangeStreamCaptureMode(&mode_);
    is_changed_ = is_wanted && result_ == success;
  }
  ~RelaxedCapture() {
    if (is_changed_) session_.driver().cuThreadExchangeStreamCaptureMode(&mode_);
  }
  RelaxedCapture(const RelaxedCapture&) = delete;
  RelaxedCapture& operator=(const RelaxedCapture&) = delete;
  Result result() const { return result_; }

 private:
  const Session& session_;
  int mode_ = capture_mode_relaxed;
  Result result_ = success;
  bool is_changed_ = false;
};

int32_t new_block(const Session& session, size_t bytes, uint64_t capture, Address& base) {
  const RelaxedCapture relaxed(session, capture != 0);
  if (relaxed.result() != success)
    return session.failed("cuThreadExchangeStreamCaptureMode", relaxed.result());
  Result result = session.driver().cuMemAlloc_v2(&base, bytes);
  // Freeing memory would wait for work on it, and a capture may not wait.
  if (result == out_of_memory && session.device().unused_bytes > 0 && capture == 0) {
    if (const int32_t code = shrink_unused(session, 0, Which::not_of_graphs)) return code;
    result = session.driver().cuMemAlloc_v2(&base, bytes);
  }
  if (result == success) return 0;
  base = 0;
  return session.failed(
      "cuMemAlloc_v2", result,
      Line("for %u bytes on device %i, which has %u", uint64_t{bytes},
           int64_t{session.device().number}, uint64_t{session.device().memory_bytes}));
}

int32_t make_live(const Session& session, const Block& block) {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  try {
    known.live.emplace(block.base, block);
    // Reserve space for all live blocks, so that releasing a block never fails.
    session.device().unused.reserve(known.live.size() + session.device().unused.size());
    return 0;
  } catch (const std::bad_alloc&) {
    known.live.erase(block.base);
    if (block.release)
      block.release(user_context_of(session.request), reinterpret_cast<void*>(block.base),
                    block.bytes, session.stream());
    else
      session.driver().cuMemFree_v2(block.base);
    throw;
  }
}

int32_t allocate_of_driver(const Session& session, size_t bytes, Address& base) {
  bytes = size_class(bytes);
  uint64_t capture = 0;
  if (const int32_t code = session.capture(capture)) return code;
  if (const int32_t code = reuse_block(session, bytes, capture, base)) return code;
  if (base != 0) return 0;
  if (capture == 0) {
    const size_t most =
        host().may_reuse(session.request.caller) ? session.device().memory_bytes / 4 : 0;
    if (const int32_t code = shrink_unused(session, most, Which::not_of_graphs)) return code;
  }
  if (const int32_t code = new_block(session, bytes, capture, base)) return code;
  Block block;
  block.base = base;
  block.bytes = bytes;
  block.device = &session.device();
  block.capture = capture;
  return make_live(session, block);
}

int32_t allocate_of_caller(const Session& session, size_t bytes,
                           retrograde_device_allocate_t allocate, Address& base) {
  Block block;
  block.release = caller_release.load();
  block.bytes = bytes;
  block.device = &session.device();
  block.base = reinterpret_cast<Address>(
      allocate(user_context_of(session.request), bytes, session.stream()));
  base = block.base;
  if (base == 0)
    return session.request.refuse("the caller's allocator must have memory",
                                  Line("it has none for %u bytes", uint64_t{bytes}),
                                  "Free device memory, or work on smaller tiles");
  return make_live(session, block);
}

// ---- releasing blocks ----

int32_t free_now(const Request& request, const Block& block) {
  Session session(request);
  int32_t code = session.open(block.device->context);
  if (code == 0) {
    const Result result = session.driver().cuMemFree_v2(block.base);
    if (result != success) code = session.failed("cuMemFree_v2", result);
  }
  const bool is_freed = code == 0;
  code = session.close(code);
  // A block that could not be freed returns to the pool; the next allocation tries again.
  if (!is_freed) push_unused(block);
  return code;
}

int32_t release_to_caller(const Request& request, const Block& block) {
  const int32_t code =
      block.release(user_context_of(request), reinterpret_cast<void*>(block.base), block.bytes,
                    block.uses == Block::Uses::one_stream ? block.stream : nullptr);
  if (code == 0) return 0;
  return request.refuse("the caller's allocator must take its memory back",
                        Line("its release gave %i", int64_t{code}), "See what it has to say");
}

}  // namespace

int32_t allocate_block(const Session& session, size_t bytes, Address& base) {
  base = 0;
  const retrograde_device_allocate_t allocate = caller_allocate.load();
  return allocate ? allocate_of_caller(session, bytes, allocate, base)
                  : allocate_of_driver(session, bytes, base);
}

void return_block(Address base) {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  const auto found = known.live.find(base);
  if (found != known.live.end()) keep(known, Block(found->second));
}

int32_t wait_for_device(const Session& session) {
  const Result result = session.driver().cuCtxSynchronize();
  return result == success ? 0 : session.failed("cuCtxSynchronize", result);
}

int32_t release_block(const Request& request, Address base) {
  Devices& known = devices();
  Block block;
  const bool reuse = host().may_reuse(request.caller);
  {
    const std::lock_guard lock(known.mutex);
    const auto found = known.live.find(base);
    if (found == known.live.end())
      return request.refuse(
          "only memory that this runtime allocated is freed by it",
          Line("nothing that it allocated begins at %p", reinterpret_cast<const void*>(base)),
          "Detach wrapped memory, release crops, and free everything once");
    block = found->second;
    if (!block.release && (reuse || block.capture != 0)) {
      keep(known, block);
      return 0;
    }
    known.live.erase(found);
  }
  return block.release ? release_to_caller(request, block) : free_now(request, block);
}

const Block* find_live_block(const Devices& known, Address address) {
  auto next = known.live.upper_bound(address);
  if (next == known.live.begin()) return nullptr;
  const Block& block = std::prev(next)->second;
  return address - block.base < block.bytes ? &block : nullptr;
}

Context context_of_memory(Address address) {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  const Block* block = find_live_block(known, address);
  return block ? block->device->context : nullptr;
}

namespace {

// Returns true if the device must be waited for before the stream uses the block.
bool add_use(Address address, Stream stream, bool waited, bool& is_elsewhere,
             const DeviceState& device) {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  auto* block = const_cast<Block*>(find_live_block(known, address));
  if (!block) return false;
  is_elsewhere = block->device != &device;
  if (is_elsewhere) return false;
  if (waited) block->uses = Block::Uses::none;
  if (waited) block->is_used_again = false;
  if (block->uses == Block::Uses::none) {
    block->uses = Block::Uses::one_stream;
    block->stream = stream;
  } else if (block->uses == Block::Uses::several || block->stream != stream) {
    if (block->is_used_again) return true;
    block->uses = Block::Uses::several;
  }
  return false;
}

}  // namespace

int32_t note_use(const Session& session, Address address) {
  bool is_elsewhere = false;
  if (add_use(address, session.stream(), false, is_elsewhere, session.device())) {
    if (const int32_t code = wait_for_device(session)) return code;
    add_use(address, session.stream(), true, is_elsewhere, session.device());
  }
  if (!is_elsewhere) return 0;
  return session.request.refuse(
      "buffers must be on the device of the call",
      Line("this one is on another device or in another context than number %i",
           int64_t{session.device().number}),
      "Copy it to the host, free its device memory, and call again");
}

int32_t wait_for_others(const Session& session, Address address) {
  {
    Devices& known = devices();
    const std::lock_guard lock(known.mutex);
    const Block* block = find_live_block(known, address);
    if (!block || is_ready_for(*block, session.stream())) return 0;
  }
  return wait_for_device(session);
}

int32_t open_for_memory(Session& session, Address address) {
  if (const int32_t code = session.open()) return code;
  const Context context = context_of_memory(address);
  if (!context || context == session.device().context) return 0;
  if (const int32_t code = session.close(0)) return code;
  if (const int32_t code = session.open(context)) return code;
  return wait_for_device(session);
}

int32_t release_unused(const Session& session) { return shrink_unused(session, 0, Which::all); }

}  // namespace retrograde::runtime

void retrograde_set_device_allocator(retrograde_device_allocate_t allocate,
                                     retrograde_device_release_t release) {
  using namespace retrograde::runtime;
  caller_release = allocate ? release : nullptr;
  caller_allocate = release ? allocate : nullptr;
}
