#include "autoschedule/plan/sharing.h"

#include <algorithm>
#include <map>
#include <set>

#include "graph/definitions/define.h"
#include "ir/build.h"

namespace retrograde::planning {

namespace {

// Whether a graph has a circle; an edge from a node to itself is one.
template <typename Node>
bool has_circle(std::set<std::pair<Node, Node>> edges) {
  while (!edges.empty()) {
    std::set<Node> later;
    for (const auto& [first, second] : edges) later.insert(second);
    if (std::erase_if(edges, [&](const auto& edge) { return !later.contains(edge.first); }) == 0)
      return true;
  }
  return false;
}

// The loops in which stages of others run, by stage.
using Hosts = std::map<StageId, LoopRef>;

Hosts hosts_of(const Plan& plan) {
  Hosts hosts;
  for (size_t f = 0; f < plan.funcs.size(); ++f) {
    const std::vector<Nest>& nests = plan.funcs[f]->nests;
    for (size_t s = 0; s < nests.size(); ++s) {
      if (nests[s].shared_with)
        hosts.emplace(StageId{static_cast<FuncId>(f), static_cast<int16_t>(s)},
                      *nests[s].shared_with);
    }
  }
  return hosts;
}

// Whether the same stages run together.
bool are_alike(const Hosts& a, const Hosts& b) {
  return std::ranges::equal(a, b, [](const auto& one, const auto& other) {
    return one.first == other.first && one.second.stage == other.second.stage;
  });
}

class SharingChecker {
 public:
  SharingChecker(const Plan& plan, const Plan* before)
      : plan_(plan),
        hosts_(hosts_of(plan)),
        is_new_(!before || !are_alike(hosts_, hosts_of(*before))) {}

  std::string run() const {
    for (const auto& [stage, host] : hosts_) {
      if (const std::string rule = broken_by(stage, host); !rule.empty())
        return text("P7: ", name(stage), " shares the loops of ", name(host.stage), ", but ", rule);
    }
    if (hosts_.empty()) return "";
    for (size_t f = 0; f < plan_.funcs.size(); ++f) {
      const auto& [compute, store, hoist] = plan_.funcs[f]->placement;
      for (const Level* level : {&compute, &store, &hoist}) {
        if (is_in_loop_of_another(*level))
          return text("P7: ", name({static_cast<FuncId>(f)}), " is placed in a loop of ",
                      name(level->loop.stage), " that another Func owns");
      }
    }
    if (!is_new_) return "";
    if (depends_on_company()) return "P7: of Funcs that run together, one depends on another";
    return keep_order() ? "" : "P7: stages of one Func would not run in their order";
  }

 private:
  const Plan& plan_;
  const Hosts hosts_;
  const bool is_new_;

  std::string name(StageId stage) const {
    return quoted(
        graph::stage_name(*plan_.program->funcs[static_cast<size_t>(stage.func)], stage.stage));
  }
  Level place_of(FuncId func) const {
    return is_output(*plan_.program, func) ? Level{Level::Kind::Root, {}}
                                           : plan_.of(func).placement.compute;
  }

  bool is_in_loop_of_another(const Level& level) const {
    const auto host = hosts_.find(level.loop.stage);
    return level.kind == Level::Kind::At && host != hosts_.end() &&
           host->second.stage.func != level.loop.stage.func &&
           level.loop.depth <= host->second.depth;
  }

  std::string broken_by(StageId stage, const LoopRef& host) const {
    if (!owner_of(stage)) return "shares its own, through others";
    if (plan_.of(host.stage.func).opacity != Opacity::None) return "";
    if (place_of(stage.func) != place_of(host.stage.func)) return "is computed elsewhere";
    const std::vector<Loop>&own = plan_.nest(stage).loops, &other = plan_.nest(host.stage).loops;
    for (size_t d = 0; d <= static_cast<size_t>(host.depth); ++d) {
      if (d >= own.size() || own[d].kind != other[d].kind) return "has none of that kind";
    }
    return "";
  }

  // The stage whose loops a stage runs in; nullopt: in a circle.
  std::optional<StageId> owner_of(StageId stage) const {
    for (size_t steps = 0; steps <= hosts_.size(); ++steps) {
      const auto host = hosts_.find(stage);
      if (host == hosts_.end()) return stage;
      stage = host->second.stage;
    }
    return std::nullopt;
  }

  // Funcs that share loops run as one. What reads one of them runs after all.
  bool depends_on_company() const {
    std::vector<FuncId> leaders(plan_.funcs.size());
    for (size_t f = 0; f < leaders.size(); ++f) leaders[f] = static_cast<FuncId>(f);
    for (const auto& [stage, host] : hosts_) {
      const FuncId from = leaders[static_cast<size_t>(stage.func)],
                   to = leaders[static_cast<size_t>(host.stage.func)];
      std::ranges::replace(leaders, from, to);
    }
    std::set<std::pair<FuncId, FuncId>> reads;
    for (size_t f = 0; f < leaders.size(); ++f) {
      for (const StageId reader : plan_.program->readers[f])
        reads.emplace(leaders[f], leaders[static_cast<size_t>(reader.func)]);
    }
    return has_circle(std::move(reads));
  }

  // The loops that stages of one Func run in come one after another, except where a stage runs in those of the one
  // before it.
  bool keep_order() const {
    std::set<std::pair<StageId, StageId>> order;
    for (size_t f = 0; f < plan_.funcs.size(); ++f) {
      int16_t first = 0;  // of the stages that run in each other's loops
      for (size_t s = 1; s < plan_.funcs[f]->nests.size(); ++s) {
        const StageId stage{static_cast<FuncId>(f), static_cast<int16_t>(s)};
        const auto host = hosts_.find(stage);
        const bool joins_own = host != hosts_.end() && host->second.stage.func == stage.func;
        if (!joins_own) first = stage.stage;
        for (StageId before{stage.func}; before.stage < first; ++before.stage)
          order.emplace(*owner_of(before), *owner_of(stage));
      }
    }
    return !has_circle(std::move(order));
  }
};

}  // namespace

std::string broken_sharing(const Plan& plan, const Plan* before) {
  return SharingChecker(plan, before).run();
}

}  // namespace retrograde::planning
