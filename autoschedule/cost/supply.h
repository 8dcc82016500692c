// supply.h -- what the caches keep from one group to the next, for one plan after another.
//
//   blur  at root  writes 4 MB      the last cache, of 16 MB, still has them when out reads them: they come from there
//   out   at root  reads 4 MB       and not from memory
//
// The call is one of many: what the last call left in the caches counts, too.
#pragma once

#include "autoschedule/cost/cost.h"
#include "autoschedule/cost/terms.h"

namespace retrograde::planning {

struct GroupPrice {
  std::vector<StageCost> stages;  // without the memory of the processor
  GroupTraffic traffic;
  double code = 0;             // of all stages
  double allocated_bytes = 0;  // for Funcs that are computed in its loops
};

class CacheSupply {
 public:
  CacheSupply(const Machine& machine, size_t groups, size_t buffers)
      : machine_(machine), groups_(groups), buffers_(buffers) {}

  // Groups run in the order of their numbers. The price is referred to; null: no group has the number.
  void change(size_t number, const GroupPrice* price);
  // Finds the times of the groups that changed, and of those for which the caches hold something else than before.
  void update();

  double seconds() const;
  const std::vector<StageCost>& stages(size_t number) const { return groups_[number].stages; }

 private:
  using Touched = std::vector<std::pair<int, double>>;  // buffers with bytes
  struct Running {
    const GroupPrice* price = nullptr;
    std::vector<StageCost> stages;  // with memory
    double seconds = 0;
    // The groups from this one to the one before, perhaps those of the call before, decide what the caches hold. Nothing
    // changes if they touch fewer bytes more or less than `spare_bytes`, and the same of the group's buffers.
    size_t since = 0;
    double spare_bytes = 0;
    bool is_changed = false;
  };
  struct Buffer {
    double most_bytes = 0;              // that any group touched
    uint64_t change = 0;                // the last update in which groups touch it otherwise
    uint64_t asked_for = 0, found = 0;  // the last looks for it, and that came across it
    double asked_bytes = 0, distance = 0;
  };
  const Machine& machine_;
  std::vector<Running> groups_;
  std::vector<Buffer> buffers_;
  uint64_t updates_ = 1, looks_ = 0;
  double changed_bytes_ = 0;  // of buffers that groups touch otherwise than before

  double room(size_t level) const;
  void note_change(int id, double bytes);
  bool touches_changed(const Running& group) const;
  void find_distances(size_t g);
  double distance_of(int id) const;
  void find_stages(size_t g);
};

}  // namespace retrograde::planning
