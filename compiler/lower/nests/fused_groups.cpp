#include "lower/nests/fused_groups.h"

#include <algorithm>
#include <map>

#include "diagnostics/error.h"
#include "lower/checks/fusing_checks.h"
#include "lower/nests/own_joining.h"

namespace retrograde::lower {

namespace {

class Grouping {
 public:
  explicit Grouping(const Program& program) : program_(program), leader_(program.funcs.size()) {
    for (size_t f = 0; f < leader_.size(); f++) leader_[f] = static_cast<int>(f);
    for (const Joining& joining : joinings_of(program)) {
      joinings_[{joining.func, joining.stage}] = joining;
      const int a = leader(joining.func), b = leader(joining.with);
      leader_[std::max(a, b)] = std::min(a, b);
    }
  }

  bool is_trivial() const { return joinings_.empty(); }

  // The groups, producers before consumers as far as the program's order allows.
  std::vector<FusedGroup> groups() {
    std::map<int, FusedGroup> by_leader;
    for (size_t f = 0; f < leader_.size(); f++)
      by_leader[leader(static_cast<int>(f))].funcs.push_back(static_cast<int>(f));
    std::vector<FusedGroup> result;
    for (auto& [first, group] : by_leader) {
      group.nests = nests_of(group.funcs);
      result.push_back(std::move(group));
    }
    return result;
  }

 private:
  using Place = std::pair<int, int>;  // Func, stage
  const Program& program_;
  std::vector<int> leader_;
  std::map<Place, Joining> joinings_;

  int leader(int f) const {
    while (leader_[f] != f) f = leader_[f];
    return f;
  }

  std::vector<FusedNest> nests_of(const std::vector<int>& funcs) {
    std::vector<FusedNest> nests;
    std::map<Place, Place> found;  // stage -> nest, position in it
    std::vector<Place> left;
    for (const int f : funcs) {
      for (size_t s = 0; s < program_.funcs[f].stages.size(); s++) {
        const Place place{f, static_cast<int>(s)};
        if (joinings_.count(place)) {
          left.push_back(place);
        } else {
          found[place] = {static_cast<int>(nests.size()), 0};
          nests.push_back({{FusedStage{f, static_cast<int>(s), -1, -1, 0, {}}}});
        }
      }
    }
    while (!left.empty()) {
      const size_t before = left.size();
      std::erase_if(left, [&](const Place& place) { return add(place, nests, found); });
      RETROGRADE_ASSERT(left.size() < before, "stages that join each other in a circle");
    }
    return in_order(std::move(nests), found);
  }

  bool add(const Place& place, std::vector<FusedNest>& nests, std::map<Place, Place>& found) const {
    const Joining& joining = joinings_.at(place);
    const auto with = found.find({joining.with, joining.with_stage});
    if (with == found.end()) return false;
    const auto [nest, position] = with->second;
    std::vector<FusedStage>& stages = nests[nest].stages;
    FusedStage stage{place.first, place.second, position, position, joining.depth, joining.align};
    // Loops that the other stage shares with a third belong to the third.
    while (stages[stage.joins].joins >= 0 && stages[stage.joins].depth >= stage.depth)
      stage.joins = stages[stage.joins].joins;
    found[place] = {nest, static_cast<int>(stages.size())};
    stages.push_back(std::move(stage));
    return true;
  }

  // The first of the stages of this Func that run in each other's loops, up to this one.
  int first_joined(const FusedStage& stage) const {
    int first = stage.stage;
    for (auto it = joinings_.find({stage.func, first}); it != joinings_.end() && is_own(it->second);
         it = joinings_.find({stage.func, first}))
      --first;
    return first;
  }

  // Orders nests so that a nest runs after the earlier stages of its Funcs.
  std::vector<FusedNest> in_order(std::vector<FusedNest> nests,
                                  const std::map<Place, Place>& found) const {
    std::vector<FusedNest> result;
    std::vector<bool> done(nests.size(), false);
    const auto is_ready = [&](const FusedStage& stage) {
      for (int s = 0; s < first_joined(stage); s++) {
        if (!done[found.at({stage.func, s}).first]) return false;
      }
      return true;
    };
    while (result.size() < nests.size()) {
      const size_t before = result.size();
      for (size_t n = 0; n < nests.size(); n++) {
        if (done[n] || !std::ranges::all_of(nests[n].stages, is_ready)) continue;
        done[n] = true;
        result.push_back(nests[n]);
      }
      if (result.size() == before) {
        const size_t stuck = std::find(done.begin(), done.end(), false) - done.begin();
        check_order_of_stages(program_, nests[stuck].stages);
      }
    }
    return result;
  }
};

// Orders groups so that each comes after all groups that it reads.
class GroupOrder {
 public:
  GroupOrder(const Program& program, const std::vector<FusedGroup>& groups)
      : program_(program),
        groups_(groups),
        group_of_(program.funcs.size()),
        state_(groups.size(), Unseen) {
    for (size_t g = 0; g < groups.size(); g++) {
      for (const int f : groups[g].funcs) group_of_[f] = static_cast<int>(g);
    }
  }

  std::vector<int> funcs() {
    for (size_t f = 0; f < group_of_.size(); f++) visit(group_of_[f]);
    return std::move(order_);
  }

 private:
  enum State : uint8_t { Unseen, Entered, Done };
  const Program& program_;
  const std::vector<FusedGroup>& groups_;
  std::vector<int> group_of_;
  std::vector<State> state_;
  std::vector<int> path_, order_;

  void visit(int g) {
    if (state_[g] == Done) return;
    if (state_[g] == Entered) check_groups_have_order(program_, groups_, path_, g);
    state_[g] = Entered;
    path_.push_back(g);
    for (const int f : groups_[g].funcs) {
      for (const int callee : callees_of(program_, f)) visit(group_of_[callee]);
    }
    path_.pop_back();
    state_[g] = Done;
    order_.insert(order_.end(), groups_[g].funcs.begin(), groups_[g].funcs.end());
  }
};

}  // namespace

void order_fused_groups(Program& program) {
  check_joinings(program);
  Grouping grouping(program);
  if (grouping.is_trivial()) return;
  const std::vector<FusedGroup> groups = grouping.groups();
  for (const FusedGroup& group : groups) check_group(program, group);
  std::vector<LoopedFunc> ordered;
  for (const int f : GroupOrder(program, groups).funcs()) ordered.push_back(program.funcs[f]);
  program.funcs = std::move(ordered);
  program.number();
}

std::vector<FusedGroup> fused_groups(const Program& program) { return Grouping(program).groups(); }

namespace {

// The kept stages of a nest, each with those that join its loops. The first nest contains the stages that still run
// with the first stage, if that is kept.
std::vector<FusedNest> parts_of(const FusedNest& nest, const std::vector<int>& kept) {
  std::vector<FusedNest> parts;
  std::vector<std::pair<int, int>> now(nest.stages.size(), {-1, -1});  // part, position in it
  for (size_t i = 0; i < nest.stages.size(); i++) {
    FusedStage stage = nest.stages[i];
    if (std::find(kept.begin(), kept.end(), stage.func) == kept.end()) continue;
    if (stage.joins >= 0 && now[stage.joins].first >= 0) {
      const auto [part, position] = now[stage.joins];
      if (now[stage.aligned_to].first == part) {
        stage.aligned_to = now[stage.aligned_to].second;
      } else {  // the stage that it was aligned to has been removed
        stage.aligned_to = position;
        std::fill(stage.align.begin(), stage.align.end(), LoopAlignStrategy::NoAlign);
      }
      stage.joins = position;
      now[i] = {part, static_cast<int>(parts[part].stages.size())};
      parts[part].stages.push_back(std::move(stage));
    } else {
      now[i] = {static_cast<int>(parts.size()), 0};
      parts.push_back({{FusedStage{stage.func, stage.stage, -1, -1, 0, {}}}});
    }
  }
  return parts;
}

}  // namespace

FusedGroup part_of(const FusedGroup& group, const std::vector<int>& kept) {
  FusedGroup result{kept, {}};
  for (const FusedNest& nest : group.nests) {
    for (FusedNest& part : parts_of(nest, kept)) result.nests.push_back(std::move(part));
  }
  return result;
}

}  // namespace retrograde::lower
