// Memory of the simulated device.
#include <sys/mman.h>

#include <cstring>

#include "simt/state.h"

namespace retrograde::simt {
namespace {

constexpr size_t page_bytes = 4096;
constexpr size_t range_bytes = size_t{16} << 30;

size_t in_pages(size_t bytes) { return (bytes + page_bytes - 1) / page_bytes * page_bytes; }
void* pointer(Address address) { return reinterpret_cast<void*>(address); }

}  // namespace

bool DeviceMemory::reserve() {
  if (begin_ != 0) return true;
  void* range =
      mmap(nullptr, range_bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (range == MAP_FAILED) return false;
  begin_ = reinterpret_cast<Address>(range);
  return true;
}

// Finds space for an allocation and an inaccessible page behind it. 0 if there is none.
Address DeviceMemory::find_gap(size_t bytes) const {
  const size_t wanted = in_pages(bytes) + page_bytes;
  Address at = begin_;
  for (const auto& [base, allocation] : live_) {
    if (base - at >= wanted) return at;
    at = base + in_pages(allocation.bytes) + page_bytes;
  }
  return begin_ + range_bytes - at >= wanted ? at : 0;
}

Result DeviceMemory::allocate(size_t bytes, ContextState* context, Address& address) {
  if (bytes == 0) return invalid_value;
  const size_t most = options().memory_bytes;
  if (bytes > most || used_bytes_ > most - bytes || !reserve()) return out_of_memory;
  const Address found = find_gap(bytes);
  if (found == 0) return out_of_memory;
  if (mprotect(pointer(found), in_pages(bytes), PROT_READ | PROT_WRITE) != 0) return out_of_memory;
  std::memset(pointer(found), 0xff, bytes);
  live_[found] = {bytes, context};
  used_bytes_ += bytes;
  address = found;
  return success;
}

Result DeviceMemory::free(Address address) {
  const auto found = live_.find(address);
  if (found == live_.end()) return invalid_value;
  const size_t bytes = found->second.bytes;
  madvise(pointer(address), in_pages(bytes), MADV_DONTNEED);
  mprotect(pointer(address), in_pages(bytes), PROT_NONE);
  live_.erase(found);
  used_bytes_ -= bytes;
  return success;
}

void DeviceMemory::free_all(const ContextState* context) {
  std::vector<Address> mine;
  for (const auto& [base, allocation] : live_) {
    if (allocation.context == context) mine.push_back(base);
  }
  for (const Address base : mine) free(base);
}

const Allocation* DeviceMemory::find(Address address, size_t bytes, Address* base) const {
  auto next = live_.upper_bound(address);
  if (next == live_.begin()) return nullptr;
  const auto& [begin, allocation] = *std::prev(next);
  const Address offset = address - begin;
  if (offset > allocation.bytes || allocation.bytes - offset < bytes) return nullptr;
  if (base) *base = begin;
  return &allocation;
}

}  // namespace retrograde::simt
