#include "testing/schedules/nesting.h"

#include <algorithm>

namespace retrograde::fuzz {

Nesting::Nesting(const ProgramFuncs& funcs)
    : loops(funcs.count()), placements(funcs.count()), funcs_(funcs), sites_(funcs.count()) {}

void Nesting::find_sites(int f) {
  for (int g = 0; g < funcs_.count(); ++g) {
    for (int s = 0; s < funcs_.stages(g); ++s) {
      if (!funcs_.producers_of_stage(g, s).count(f)) continue;
      if (is_inlined(g)) {
        sites_[f].insert(sites_[g].begin(), sites_[g].end());
      } else {
        sites_[f].insert({g, s});
      }
    }
  }
}

std::vector<Level> Nesting::levels_around(Site site) const {
  const auto [f, stage] = site;
  std::vector<Level> levels;
  const bool is_guest = stage == 0 && companion && companion->func == f;
  for (const Loop& loop : loops[f][stage][0]) {
    if (is_guest && loop.name == companion->loop) return with_shared_loops(levels);
    levels.push_back({f, stage, loop.name});
  }
  if (placements[f].where != Where::At) return levels;
  const Level& at = placements[f].compute;
  const std::vector<Level> around = levels_around({at.func, at.stage});
  levels.insert(levels.end(), std::ranges::find(around, at), around.end());
  return levels;
}

// Shared loops belong to the other Func; they are known once it is scheduled.
std::vector<Level> Nesting::with_shared_loops(std::vector<Level> levels) const {
  if (loops[companion->with].empty()) return levels;
  const std::vector<Level> around = levels_around({companion->with, 0});
  const auto first = std::ranges::find(around, Level{companion->with, 0, companion->loop});
  levels.insert(levels.end(), first, around.end());
  return levels;
}

bool Nesting::is_around_all_sites(const Level& level, int f) const {
  return std::ranges::all_of(sites_[f], [&](const Site& site) {
    const std::vector<Level> around = levels_around(site);
    return std::ranges::find(around, level) != around.end();
  });
}

bool Nesting::is_legal_level(const Level& level) const {
  for (int s = 0; s < funcs_.stages(level.func); ++s) {
    for (const Loops& variant : loops[level.func][s]) {
      const auto at = std::ranges::find(variant, level.name, &Loop::name);
      if ((s == level.stage) == (at == variant.end())) return false;
      if (std::any_of(at, variant.end(),
                      [](const Loop& loop) { return loop.type == ForType::Vectorized; }))
        return false;
    }
  }
  return true;
}

bool Nesting::runs_in_order(const Level& level) const {
  const LoopVariants& variants = loops[level.func][level.stage];
  if (variants.size() > 1) return false;
  return std::ranges::all_of(variants[0], [&](const Loop& loop) {
    return loop.name != level.name || loop.type == ForType::Serial ||
           loop.type == ForType::Unrolled;
  });
}

int Nesting::nesting_of(int f, const Level& level) const {
  const int own = funcs_.is_pure(f) ? 1 : 2;
  const Placement& around = placements[level.func];
  return around.where == Where::At ? own + nesting_of(level.func, around.compute) : own;
}

}  // namespace retrograde::fuzz
