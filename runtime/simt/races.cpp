#include "simt/races.h"

#include <algorithm>

namespace retrograde::simt {
namespace {

constexpr uint8_t other_threads = 1, other_warps = 2, other_blocks = 4;
uint32_t warp_of(const Moment& moment) { return moment.thread / 32u; }

// Whether all accesses that `before` represents happened before `now`.
bool is_ordered(const Moment& before, const Moment& now) {
  if (before.interval == 0) return true;
  if ((before.spread & other_blocks) || before.block != now.block) return false;
  if (before.interval != now.interval) return true;
  if (before.spread & other_warps) return false;
  const bool by_warp = warp_of(before) == warp_of(now) && before.part != now.part;
  return by_warp || (before.thread == now.thread && !(before.spread & other_threads));
}

// Adds an access to those that a moment represents.
void add(Moment& all, const Moment& now) {
  uint8_t spread = all.spread & other_blocks;
  if (all.interval != 0) {
    if (all.block != now.block) {
      spread |= other_blocks;
    } else if (all.interval == now.interval) {
      spread |= all.spread & other_warps;
      if (warp_of(all) != warp_of(now))
        spread |= other_warps;
      else if (all.part == now.part)
        spread |= (all.spread & other_threads) | (all.thread != now.thread ? other_threads : 0);
    }
  }
  all = now;
  all.spread = spread;
}

void look(Conflict& conflict, const Moment& before, const Moment& now, const char* did) {
  if (!conflict.is_there && !is_ordered(before, now)) conflict = {true, before, did};
}

// Merges the conflicts found in `bytes` bytes, beginning at byte `from` of the access.
void join(Conflict& all, const Conflict& found, uint64_t from, uint64_t bytes) {
  if (!found.is_there) return;
  uint64_t stored = all.stored;
  if (found.is_with_store && from < 64) stored |= ((uint64_t{1} << bytes) - 1) << from;
  if (!all.is_there || (all.is_with_store && !found.is_with_store)) all = found;
  all.stored = stored;
}

Conflict record_in(Cell& cell, Access access, const Moment& now) {
  Conflict conflict;
  look(conflict, cell.write, now, "store");
  conflict.is_with_store = conflict.is_there;
  if (access != Access::load) look(conflict, cell.read, now, "load");
  if (access != Access::atomic) look(conflict, cell.atomic, now, "atomic update");
  add(access == Access::load ? cell.read : access == Access::store ? cell.write : cell.atomic, now);
  return conflict;
}

}  // namespace

Shadow::Page& Shadow::page_of(uint64_t word) {
  const uint64_t number = word / page_words;
  if (last_ && last_number_ == number) return *last_;
  std::unique_ptr<Page>& page = pages_[number];
  if (!page) page = std::make_unique<Page>();
  if (page->generation != generation_) {
    std::fill_n(page->words, page_words, Cell());
    page->has_bytes.reset();
    page->generation = generation_;
  }
  last_ = page.get();
  last_number_ = number;
  return *last_;
}

// `from`: index of the first of these bytes within the access.
void Shadow::record_word(uint64_t begin, uint64_t end, Access access, const Moment& now,
                         uint64_t from, Conflict& all) {
  Page& page = page_of(begin / 4);
  const auto index = static_cast<uint32_t>(begin / 4 % page_words);
  Cell& whole = page.words[index];
  if (!page.has_bytes[index]) {
    if (end - begin == 4) return join(all, record_in(whole, access, now), from, 4);
    if (!page.bytes) page.bytes = std::make_unique_for_overwrite<Cell[]>(4 * page_words);
    std::fill_n(&page.bytes[4 * index], 4, whole);
    page.has_bytes.set(index);
  }
  for (uint64_t byte = begin; byte < end; byte++)
    join(all, record_in(page.bytes[4 * index + byte % 4], access, now), from + byte - begin, 1);
}

Conflict Shadow::record(uint64_t address, int32_t bytes, Access access, const Moment& now) {
  Conflict all;
  const uint64_t begin = address, end = address + static_cast<uint64_t>(bytes);
  while (address < end) {
    const uint64_t word_end = std::min(end, (address / 4 + 1) * 4);
    record_word(address, word_end, access, now, address - begin, all);
    address = word_end;
  }
  return all;
}

}  // namespace retrograde::simt
