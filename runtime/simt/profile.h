// Counts a kernel's memory transactions by warp request: the accesses that the 32 threads of a warp make by one
// statement at one time.
#pragma once

#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "simt/races.h"
#include "simt/simt_driver.h"

namespace retrograde::simt {

class Profile {
 public:
  explicit Profile(int32_t sites) : sites_(static_cast<size_t>(sites) + 1) {}
  // Threads of a block are added one after another, each with its accesses in order.
  void add(uint32_t thread, int32_t site, uint64_t address, int32_t bytes, Access, bool is_shared);
  void end_block();
  retrograde_simt_profile sums = {};

 private:
  struct Piece {
    uint32_t thread;
    uint64_t address;
    int32_t bytes;
  };
  struct Request {
    Access access = Access::load;
    bool is_shared = false;
    std::vector<Piece> pieces;
  };
  void end_request(Request&);
  void end_global(const Request&);
  void end_shared(const Request&);

  const size_t sites_;
  // How often each thread has reached each site, and the requests by warp, site and time.
  std::unordered_map<uint64_t, uint32_t> times_;
  std::unordered_map<uint64_t, Request> requests_[32];  // by warp
};

// Adds to the totals of all launches.
void add_profile(const std::string& kernel, const retrograde_simt_profile&);

}  // namespace retrograde::simt
