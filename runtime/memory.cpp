// Memory for intermediate results: a pool of large blocks above the system's allocator.
//
// A pipeline allocates the same few large blocks on every call. The system would map and zero their pages each time,
// which costs more than computing most stages. So released blocks stay in a list, oldest first, and are reused for
// requests that fit without much waste. The oldest are freed when the list exceeds its limit.
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <mutex>
#include <new>
#include <vector>

#include "huge_pages.h"
#include "report.h"

namespace retrograde::runtime {
namespace {

constexpr size_t alignment = retrograde_allocation_alignment;
constexpr size_t small_bytes = size_t{64}
                               << 10;  // below this size the system's free lists are fast
constexpr size_t page_bytes = 4096;
constexpr size_t max_blocks = 256;

// Precedes every block.
struct Header {
  size_t capacity;   // bytes after the header
  void* allocation;  // the pointer that the system returned
};
static_assert(sizeof(Header) <= alignment);

Header* header_of(void* block) {
  return reinterpret_cast<Header*>(static_cast<char*>(block) - sizeof(Header));
}

size_t round_up(size_t bytes, size_t multiple) {
  return (bytes + multiple - 1) / multiple * multiple;
}

size_t capacity_for(size_t bytes) {
  return bytes < small_bytes ? round_up(std::max<size_t>(bytes, 1), sizeof(Header))
                             : round_up(bytes + alignment, page_bytes) - alignment;
}

size_t machine_bytes() {
  const long pages = sysconf(_SC_PHYS_PAGES), bytes = sysconf(_SC_PAGESIZE);
  return pages > 0 && bytes > 0 ? static_cast<size_t>(pages) * static_cast<size_t>(bytes)
                                : size_t{4} << 30;
}

void* with_header(void* allocation, void* block, size_t capacity) {
  *header_of(block) = {capacity, allocation};
  return block;
}

// malloc plus manual alignment. posix_memalign would split off a piece each time, and free would merge it again, which
// takes longer than a stage needs for a row. The padding is minimal: for blocks of up to one kilobyte, such as a row of
// a small picture, malloc has per-thread lists; larger blocks take several times as long.
void* small_malloc(size_t capacity) {
  static_assert(alignof(std::max_align_t) == sizeof(Header));  // malloc returns multiples of this
  void* allocation = std::malloc(capacity + alignment);
  if (!allocation) return nullptr;
  const uintptr_t behind = reinterpret_cast<uintptr_t>(allocation) + sizeof(Header);
  const size_t skipped = round_up(behind, alignment) - behind;
  return with_header(allocation, static_cast<char*>(allocation) + sizeof(Header) + skipped,
                     capacity);
}

// Systems that overcommit would map a block larger than the machine's memory, and kill the process when it is filled.
void* system_malloc(size_t capacity) {
  const size_t bytes = capacity + alignment;
  if (bytes < small_bytes) return small_malloc(capacity);
  if (bytes > machine_bytes()) return nullptr;
  const bool huge = bytes >= 4 * huge_page_bytes;
  void* allocation = nullptr;
  if (posix_memalign(&allocation, huge ? huge_page_bytes : alignment, bytes) != 0) return nullptr;
  if (huge) advise_huge_pages(allocation, bytes);
  return with_header(allocation, static_cast<char*>(allocation) + alignment, capacity);
}

void system_free(void* block) { std::free(header_of(block)->allocation); }

class Pool {
 public:
  // A released block with room for `capacity`, at most a quarter larger; null if there is none.
  void* take(size_t capacity) {
    const std::lock_guard lock(mutex_);
    auto best = blocks_.end();
    for (auto it = blocks_.begin(); it != blocks_.end(); ++it) {
      const size_t has = header_of(*it)->capacity;
      if (has < capacity || has > capacity + capacity / 4) continue;
      if (best == blocks_.end() || has <= header_of(*best)->capacity) best = it;
    }
    if (best == blocks_.end()) return nullptr;
    void* block = *best;
    held_ -= header_of(block)->capacity;
    blocks_.erase(best);
    return block;
  }

  void give(void* block) {
    const std::lock_guard lock(mutex_);
    const size_t capacity = header_of(block)->capacity;
    if (capacity > limit_ || !reserve()) return system_free(block);
    blocks_.push_back(block);
    held_ += capacity;
    shrink_to(limit_);
  }

  void set_limit(size_t bytes) {
    const std::lock_guard lock(mutex_);
    limit_ = bytes;
    shrink_to(limit_);
  }
  void release() {
    const std::lock_guard lock(mutex_);
    shrink_to(0);
  }
  size_t held() {
    const std::lock_guard lock(mutex_);
    return held_;
  }

 private:
  bool reserve() {
    try {
      blocks_.reserve(max_blocks);
      return true;
    } catch (const std::bad_alloc&) {
      return false;
    }
  }
  void shrink_to(size_t bytes) {
    size_t gone = 0;
    while (gone < blocks_.size() && (held_ > bytes || blocks_.size() - gone >= max_blocks)) {
      held_ -= header_of(blocks_[gone])->capacity;
      system_free(blocks_[gone++]);
    }
    blocks_.erase(blocks_.begin(), blocks_.begin() + static_cast<std::ptrdiff_t>(gone));
  }

  std::mutex mutex_;
  std::vector<void*> blocks_;  // oldest first
  size_t held_ = 0;
  size_t limit_ = machine_bytes() / 4;
};

Pool& pool() {
  static Pool& instance = *new Pool;  // never destroyed: other static objects may free at exit
  return instance;
}

// Returns false if the request is negative or does not fit the address space.
bool allocation_bytes(int64_t elements, int64_t element_bytes, size_t* bytes) {
  constexpr int64_t largest = INT64_MAX - 4 * static_cast<int64_t>(page_bytes);
  int64_t product = 0;
  if (elements < 0 || element_bytes < 0) return false;
  if (__builtin_mul_overflow(elements, element_bytes, &product) || product > largest) return false;
  *bytes = std::max<size_t>(static_cast<size_t>(product), 1);
  return true;
}

}  // namespace
}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

void* retrograde_pool_malloc(size_t bytes) {
  if (bytes > SIZE_MAX / 2) return nullptr;
  const size_t capacity = rt::capacity_for(bytes);
  if (capacity < rt::small_bytes - rt::alignment) return rt::system_malloc(capacity);
  if (void* block = rt::pool().take(capacity)) return block;
  if (void* block = rt::system_malloc(capacity)) return block;
  rt::pool().release();  // free the pool's own blocks and try again
  return rt::system_malloc(capacity);
}

void retrograde_pool_free(void* block) {
  if (!block) return;
  const bool small = rt::header_of(block)->capacity < rt::small_bytes - rt::alignment;
  small ? rt::system_free(block) : rt::pool().give(block);
}

void retrograde_pool_set_limit(size_t bytes) { rt::pool().set_limit(bytes); }
size_t retrograde_pool_bytes(void) { return rt::pool().held(); }
void retrograde_pool_release(void) { rt::pool().release(); }

void* retrograde_allocate(retrograde_context* context, int64_t elements, int64_t element_bytes) {
  size_t bytes = 0;
  if (elements > INT32_MAX || !rt::allocation_bytes(elements, element_bytes, &bytes))
    return nullptr;
  return context && context->malloc_handler ? context->malloc_handler(context, bytes)
                                            : retrograde_pool_malloc(bytes);
}

int32_t retrograde_allocation_error(retrograde_context* context, const char* name, int64_t elements,
                                    int64_t element_bytes) {
  size_t bytes = 0;
  if (elements < 0) {
    return retrograde_report_error(
        context, retrograde_error_extents_negative,
        "cannot allocate \"%s\": its number of elements is negative; it is "
        "%i. Check the extents of the buffers",
        name, elements);
  }
  if (elements > INT32_MAX) {
    return retrograde_report_error(
        context, retrograde_error_allocation_too_large,
        "cannot allocate \"%s\": places in it are numbered in 31 bits, so that it may have "
        "2147483647 elements; it has %i. Compute it in smaller parts, for example with compute_at",
        name, elements);
  }
  if (!rt::allocation_bytes(elements, element_bytes, &bytes)) {
    return retrograde_report_error(
        context, retrograde_error_allocation_too_large,
        "cannot allocate \"%s\": its size does not fit 64 bits; it has %i "
        "elements of %i bytes. Compute it in smaller parts",
        name, elements, element_bytes);
  }
  return retrograde_report_error(
      context, retrograde_error_out_of_memory,
      "cannot allocate \"%s\": there is not enough memory; it needs %u bytes. "
      "Compute it in smaller parts, for example with compute_at",
      name, static_cast<uint64_t>(bytes));
}

void retrograde_free(retrograde_context* context, void* block) {
  if (!block) return;
  context && context->free_handler ? context->free_handler(context, block)
                                   : retrograde_pool_free(block);
}

void retrograde_free_all(retrograde_context* context, void** blocks, int64_t count) {
  while (count > 0) retrograde_free(context, blocks[--count]);
}
