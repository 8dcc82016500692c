// Race detection. A race is two unordered accesses of different threads to the same bytes, at least one of them a write
// and not both atomic. Accesses are ordered by a thread's program order, by a block's barrier, which ends an interval,
// and by a warp's barrier, which ends a part of the interval for that warp's threads.
//
// Each four-byte word has a cell that records the last write and the last reads. Words that are accessed by smaller
// parts have a cell for each byte. If there were several reads since a write, the cell keeps the last one and how
// widely the others were spread. This decides whether a write conflicts with one of them (as in FastTrack, Flanagan and
// Freund 2009; barriers need only a few clocks in place of vectors).
#pragma once

#include <bitset>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

namespace retrograde::simt {

// An access: who made it, and when.
struct Moment {
  uint32_t block = 0;
  uint32_t interval = 0;  // of the block, from 1; 0: no access
  uint32_t part = 0;      // part of the interval, for the thread's warp
  uint16_t thread = 0;    // in the block
  int16_t site = -1;
  uint8_t spread = 0;  // other accesses since: 1 by this warp, 2 by other warps, 4 by other blocks
};

struct Cell {
  Moment write, read, atomic;
};

struct Conflict {
  bool is_there = false;
  Moment other;
  const char* other_did = "";
  bool is_with_store = false;
  uint64_t stored = 0;  // bit i: others stored byte i of the access
};

enum class Access { load, store, atomic };

// The access records of one kind of memory during one launch, or one block.
class Shadow {
 public:
  // `address` may count from any origin. Returns the first conflict, preferring one with a load or atomic update.
  // Storing an equal value is not a conflict: the caller checks this later, for the bytes that others stored.
  Conflict record(uint64_t address, int32_t bytes, Access, const Moment&);
  // Forgets all accesses.
  void clear() {
    generation_++;
    last_ = nullptr;
  }

 private:
  static constexpr uint64_t page_words = 256;
  struct Page {
    uint64_t generation = 0;
    Cell words[page_words];
    std::bitset<page_words> has_bytes;  // words that are accessed in parts
    std::unique_ptr<Cell[]> bytes;      // four per word, allocated once one is needed
  };
  Page& page_of(uint64_t word);
  void record_word(uint64_t begin, uint64_t end, Access, const Moment&, uint64_t from, Conflict&);
  std::unordered_map<uint64_t, std::unique_ptr<Page>> pages_;
  Page* last_ = nullptr;
  uint64_t last_number_ = 0, generation_ = 0;
};

}  // namespace retrograde::simt
