// Advice to the system to use huge pages, which take fewer page faults when a large block is first written.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>

namespace retrograde::runtime {

constexpr size_t huge_page_bytes = size_t{2} << 20;  // x86-64 and AArch64 Linux

// For the huge pages that lie inside of the memory. Failure changes nothing, since this is only a hint.
inline void advise_huge_pages(void* memory, size_t bytes) {
#ifdef MADV_HUGEPAGE
  const auto first = reinterpret_cast<uintptr_t>(memory);
  const uintptr_t begin = (first + huge_page_bytes - 1) / huge_page_bytes * huge_page_bytes;
  const uintptr_t end = (first + bytes) / huge_page_bytes * huge_page_bytes;
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#else
  static_cast<void>(memory), static_cast<void>(bytes);
#endif
}

}  // namespace retrograde::runtime
