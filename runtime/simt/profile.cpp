#include "simt/profile.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "simt/state.h"

namespace retrograde::simt {
namespace {

constexpr uint64_t sector_bytes = 32;
constexpr uint64_t banks = 32, bank_bytes = 4;

std::map<std::string, retrograde_simt_profile>& profiles() {
  static auto& all = *new std::map<std::string, retrograde_simt_profile>;
  return all;
}

// Works because all fields are int64_t.
void add_to(retrograde_simt_profile& sum, const retrograde_simt_profile& one) {
  constexpr size_t fields = sizeof one / sizeof(int64_t);
  std::array<int64_t, fields> a, b;
  std::memcpy(a.data(), &sum, sizeof sum);
  std::memcpy(b.data(), &one, sizeof one);
  for (size_t i = 0; i < fields; i++) a[i] += b[i];
  std::memcpy(&sum, a.data(), sizeof sum);
}

int64_t distinct(std::vector<uint64_t>& values) {
  std::sort(values.begin(), values.end());
  return std::unique(values.begin(), values.end()) - values.begin();
}

}  // namespace

void Profile::add(uint32_t thread, int32_t site, uint64_t address, int32_t bytes, Access access,
                  bool is_shared) {
  const auto place = static_cast<uint64_t>(site + 1);
  const uint64_t time = times_[thread * sites_ + place]++;
  Request& request = requests_[thread / 32][time * sites_ + place];
  request.access = access;
  request.is_shared = is_shared;
  request.pieces.push_back({thread, address, bytes});
}

void Profile::end_block() {
  for (auto& warp : requests_) {
    for (auto& [key, request] : warp) end_request(request);
    warp.clear();
  }
  times_.clear();
}

void Profile::end_request(Request& request) {
  std::sort(request.pieces.begin(), request.pieces.end(),
            [](const Piece& a, const Piece& b) { return a.thread < b.thread; });
  int64_t bytes = 0;
  for (const Piece& piece : request.pieces) bytes += piece.bytes;
  if (request.is_shared) {
    sums.shared_requests++;
    sums.shared_bytes += bytes;
    end_shared(request);
  } else {
    sums.global_requests++;
    sums.global_bytes += bytes;
    end_global(request);
  }
}

void Profile::end_global(const Request& request) {
  std::vector<uint64_t> sectors, all_bytes;
  for (const Piece& piece : request.pieces) {
    const uint64_t end = piece.address + static_cast<uint64_t>(piece.bytes);
    for (uint64_t s = piece.address / sector_bytes; s * sector_bytes < end; s++)
      sectors.push_back(s);
    for (uint64_t b = piece.address; b < end; b++) all_bytes.push_back(b);
  }
  const int64_t count = distinct(sectors);
  const int64_t dense = distinct(all_bytes);
  sums.global_sectors += count;
  sums.ideal_sectors += (dense + int64_t{sector_bytes} - 1) / int64_t{sector_bytes};
  (request.access == Access::load    ? sums.load_sectors
   : request.access == Access::store ? sums.store_sectors
                                     : sums.atomic_sectors) += count;
}

// Shared memory serves accesses of eight bytes for half a warp at a time, and of sixteen bytes for a quarter. In each
// pass every bank serves one word, to all threads that access it.
void Profile::end_shared(const Request& request) {
  const int32_t widest =
      std::max_element(request.pieces.begin(), request.pieces.end(),
                       [](const Piece& a, const Piece& b) { return a.bytes < b.bytes; })
          ->bytes;
  const size_t together = widest <= 4 ? 32 : widest <= 8 ? 16 : 8;
  for (size_t begin = 0; begin < request.pieces.size(); begin += together) {
    std::array<std::vector<uint64_t>, banks> words;
    for (size_t i = begin; i < std::min(begin + together, request.pieces.size()); i++) {
      const Piece& piece = request.pieces[i];
      const uint64_t end = piece.address + static_cast<uint64_t>(piece.bytes);
      for (uint64_t w = piece.address / bank_bytes; w * bank_bytes < end; w++)
        words[w % banks].push_back(w);
    }
    int64_t passes = 1;
    for (auto& of_bank : words) passes = std::max(passes, distinct(of_bank));
    sums.bank_conflicts += passes - 1;
  }
}

void add_profile(const std::string& kernel, const retrograde_simt_profile& sums) {
  add_to(profiles()[kernel], sums);
}

}  // namespace retrograde::simt

using namespace retrograde::simt;

int32_t retrograde_simt_get_profile(const char* kernel, retrograde_simt_profile* out) {
  const std::lock_guard lock(driver_mutex());
  *out = {};
  bool is_there = false;
  for (const auto& [name, sums] : profiles()) {
    if (kernel && name != kernel) continue;
    add_to(*out, sums);
    is_there = true;
  }
  return is_there;
}

void retrograde_simt_reset_profile(void) {
  const std::lock_guard lock(driver_mutex());
  profiles().clear();
}
