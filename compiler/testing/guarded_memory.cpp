#include "testing/guarded_memory.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <unordered_map>
#include <vector>

namespace retrograde::fuzz {

namespace {

constexpr size_t alignment = 8;  // that of the largest element; vectors need no more

// Accessible pages, followed by one protected page.
struct Mapping {
  uint8_t* first;
  size_t bytes;  // size of the accessible pages
};

// Mappings are kept and reused for blocks of the same number of pages, because programs allocate in their inner loops.
struct Memory {
  std::mutex mutex;
  std::map<size_t, std::vector<Mapping>> free;  // by size in bytes
  std::unordered_map<void*, Mapping> used;      // by block
};

Memory& memory() {
  static Memory& instance = *new Memory;
  return instance;
}

size_t page_bytes() { return static_cast<size_t>(sysconf(_SC_PAGESIZE)); }

size_t round_up(size_t bytes, size_t to) { return (bytes + to - 1) / to * to; }

// Returns a mapping with a null first page if there is no memory.
Mapping map_pages(size_t bytes) {
  const size_t page = page_bytes();
  void* const all =
      mmap(nullptr, bytes + page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (all == MAP_FAILED) return {nullptr, 0};
  auto* const first = static_cast<uint8_t*>(all);
  if (mprotect(first + bytes, page, PROT_NONE) == 0) return {first, bytes};
  munmap(all, bytes + page);
  return {nullptr, 0};
}

}  // namespace

void* allocate_guarded(void*, size_t bytes) {
  if (bytes > SIZE_MAX / 2) return nullptr;
  const size_t room = round_up(bytes > 0 ? bytes : 1, alignment);
  const size_t all = round_up(room, page_bytes());
  const std::lock_guard<std::mutex> lock(memory().mutex);
  std::vector<Mapping>& free = memory().free[all];
  if (free.empty()) {
    const Mapping made = map_pages(all);
    if (!made.first) return nullptr;
    free.push_back(made);
  }
  const Mapping mapping = free.back();
  free.pop_back();
  void* const block = mapping.first + all - room;
  memory().used[block] = mapping;
  return block;
}

void free_guarded(void*, void* block) {
  if (!block) return;
  const std::lock_guard<std::mutex> lock(memory().mutex);
  const auto it = memory().used.find(block);
  memory().free[it->second.bytes].push_back(it->second);
  memory().used.erase(it);
}

}  // namespace retrograde::fuzz
