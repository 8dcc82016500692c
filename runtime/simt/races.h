// Races: two threads that access the same bytes, one of them writing and not both atomically, with
// nothing that orders them. What orders: the program of one thread; a barrier of the block, which ends an
// interval; a barrier of the warp, which ends a part of the interval for the threads of the warp.
//
// Each word of four bytes has a cell that remembers the last write and the last reads; words that are
// accessed by smaller parts have one for each byte. Of several reads since a write, the cell keeps the
// last one and how far the others were spread: that decides whether a write conflicts with one of them
// (as in FastTrack, Flanagan and Freund 2009, with the few clocks that barriers need in place of vectors).
#pragma once

#include <bitset>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

namespace retrograde::simt {

// Who accesses, and when.
struct Moment {
  uint32_t block = 0;
  uint32_t interval = 0;  // of the block, from 1; 0: nobody
  uint32_t part = 0;      // of the interval, for the thread's warp
  uint16_t thread = 0;    // of the block
  int16_t site = -1;
  uint8_t spread = 0;  // others since: 1 of this warp, 2 of other warps, 4 of other blocks
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

// Of one kind of memory during one launch, or one block.
class Shadow {
 public:
  // `address` is counted from anywhere. The first conflict, with a load or an atomic update if there is
  // one. A store over the same values is none: the caller says so later of the bytes that others stored.
  Conflict record(uint64_t address, int32_t bytes, Access, const Moment&);
  // As if nothing had been accessed.
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
    std::unique_ptr<Cell[]> bytes;      // four for each word, once one of them is
  };
  Page& page_of(uint64_t word);
  void record_word(uint64_t begin, uint64_t end, Access, const Moment&, uint64_t from, Conflict&);
  std::unordered_map<uint64_t, std::unique_ptr<Page>> pages_;
  Page* last_ = nullptr;
  uint64_t last_number_ = 0, generation_ = 0;
};

}  // namespace retrograde::simt
