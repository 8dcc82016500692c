// row_hosts.h -- sums of a row are computed in the loop over rows of the Func that uses them.
//
//   mean(y) += in(r, y) / n;  variance(y) += square(in(r, y) - mean(y))
//   out(x, y) = (in(x, y) - mean(y)) / sqrt(variance(y))
//
//   parallel for y: mean += ...               parallel for y:
//   parallel for y: variance += ...             for r: mean += ...
//   parallel for y: for x: out = ...     =>     for r: variance += ...
//                                               for x: out = ...
//
// The consumer is the host, the sums are its members. A row comes from memory once and stays in a cache near a core. It
// may be a plane or more, which lies together in memory, and may be named by the quotient of a coordinate: out(x, y, c)
// may read mean(c / 8). Outputs that only copy a member share the loop (compute_with), so that its values may leave the
// pipeline.
//
// What is stored between the sums and the host, element by element, is computed in the loop, too, and may read members.
//
// A member is computed once for each row, so only the host and other members may read it, at the same row. A sum with
// other dimensions than those of rows stays where it is, because register tiles need several rows; the private parts of
// an adjoint do not. Sums for other elements that read the same rows join the loop (row_guests.h).
// Source: folklore; PyTorch's kernels of normalisation layers are written this way by hand.
// Tests: test/autoschedule/row_hosts_test.cpp.
#pragma once

#include <functional>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "autoschedule/stored_reads.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Gives loops to one stage of a Func that is computed at root.
using GiveLoopsOfStage =
    std::function<void(const FuncPtr& f, int stage, const SizeEstimate& sizes)>;

// One coordinate of a row: that of a dimension of the host, divided.
struct RowCoordinate {
  size_t dimension = 0;
  int64_t divisor = 1;
  auto operator<=>(const RowCoordinate&) const = default;
};
// The coordinates by argument of a Func; nullopt: the argument does not move with rows.
using RowCoordinates = std::vector<std::optional<RowCoordinate>>;

// A loop over groups of rows: every so many rows along one coordinate start a group.
struct RowGroup {
  size_t row = 0;  // index into RowHost::rows
  int64_t step = 1;
  friend bool operator==(const RowGroup&, const RowGroup&) = default;
};

// Sums that join the loop over rows (row_guests.h), or over groups of rows (row_groups.h).
struct RowGuest {
  FuncPtr sums;   // stage 1 of it joins
  FuncPtr block;  // that it adds up; null: it adds terms
  // Its variables that name the row, as `RowHost::rows`, or the group, as `RowHost::groups`.
  std::vector<std::string> loops;
};

struct RowHost {
  FuncPtr host;
  std::vector<RowCoordinate> rows;  // in the order of dimensions
  std::vector<FuncPtr> members;     // consumers first
  std::vector<FuncPtr> copies;
  std::vector<RowGuest> guests;
  std::vector<RowGroup> groups;  // that all guests share, innermost first; empty: they share rows
  size_t parallel_groups = 0;    // of these, outermost first
  std::vector<FuncPtr> inside;   // pure Funcs that the host alone reads, each element for its own
  std::vector<FuncPtr> shared;   // pure Funcs that host, members and guests alone read
  std::unordered_map<const Symbol*, RowCoordinates> coordinates;  // of the host, members and copies
};

class RowHosts {
 public:
  // Hosts among the Funcs that will be at root and have no loops yet. `excluded`: none of these, in any role.
  RowHosts(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
           const std::unordered_set<const Symbol*>& excluded, const SizeEstimate& sizes);

  // Whether the Func has a role in one of them, so that nothing else may move it.
  bool contains(const FuncContents& f) const { return role_.contains(&f); }
  std::unordered_set<const Symbol*> all() const;

  // Gives a Func with a role, whose producers have loops, its own.
  void give_loops(const FuncPtr& f, const GiveLoopsOfStage& give) const;
  // Moves the members, when all have loops.
  void move() const;

 private:
  std::vector<RowHost> hosts_;
  std::unordered_map<const Symbol*, size_t> role_;  // the index of the host
  const SizeEstimate& sizes_;
};

}  // namespace retrograde::autoschedule
