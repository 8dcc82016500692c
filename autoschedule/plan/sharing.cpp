#include "autoschedule/plan/sharing.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "graph/definitions/define.h"
#include "ir/build.h"

namespace retrograde::planning {

namespace {

using Edges = std::vector<std::pair<size_t, size_t>>;

// Whether a graph of numbered nodes has a circle; an edge from a node to itself is one. It takes away nodes that no edge
// leads to, until none is left (A. Kahn, Topological sorting of large networks, 1962).
bool has_circle(size_t nodes, const Edges& edges) {
  std::vector<size_t> edges_to(nodes), first_from(nodes + 1), targets(edges.size());
  for (const auto& [from, to] : edges) ++edges_to[to], ++first_from[from + 1];
  for (size_t n = 0; n < nodes; ++n) first_from[n + 1] += first_from[n];
  std::vector<size_t> end_from(first_from.begin(), first_from.end() - 1);
  for (const auto& [from, to] : edges) targets[end_from[from]++] = to;
  std::vector<size_t> free;
  for (size_t n = 0; n < nodes; ++n) {
    if (edges_to[n] == 0) free.push_back(n);
  }
  for (size_t i = 0; i < free.size(); ++i) {
    for (size_t e = first_from[free[i]]; e < end_from[free[i]]; ++e) {
      if (--edges_to[targets[e]] == 0) free.push_back(targets[e]);
    }
  }
  return free.size() < nodes;
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
      if (from != to) std::ranges::replace(leaders, from, to);
    }
    Edges reads;
    for (size_t f = 0; f < leaders.size(); ++f) {
      for (const StageId reader : plan_.program->readers[f])
        reads.emplace_back(leaders[f], leaders[static_cast<size_t>(reader.func)]);
    }
    return has_circle(leaders.size(), reads);
  }

  // The loops that stages of one Func run in come one after another, except where a stage runs in those of the one
  // before it.
  bool keep_order() const {
    std::map<StageId, size_t> numbers;  // of the stages that own loops
    const auto owner = [&](StageId stage) {
      return numbers.emplace(*owner_of(stage), numbers.size()).first->second;
    };
    std::set<FuncId> company;
    for (const auto& [stage, host] : hosts_) company.insert({stage.func, host.stage.func});
    Edges order;
    for (const FuncId func : company) {
      std::vector<size_t> before, together;  // owners of the stages that run in each other's loops
      for (size_t s = 0; s < plan_.of(func).nests.size(); ++s) {
        const StageId stage{func, static_cast<int16_t>(s)};
        const auto host = hosts_.find(stage);
        if (host == hosts_.end() || host->second.stage.func != func)
          before = std::exchange(together, {});
        together.push_back(owner(stage));
        for (const size_t one : before) order.emplace_back(one, together.back());
      }
    }
    return !has_circle(numbers.size(), order);
  }
};

}  // namespace

std::string broken_sharing(const Plan& plan, const Plan* before) {
  return SharingChecker(plan, before).run();
}

}  // namespace retrograde::planning
