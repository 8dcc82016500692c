#include <algorithm>
#include <array>
#include <string_view>

#include "autoschedule/moves/move.h"

namespace retrograde::planning {

#define RETROGRADE_MOVE(name) \
  std::vector<Plan> name(const Plan& plan, FuncId func, const Context& context);
namespace moves {
#include "autoschedule/moves/list.def"
}  // namespace moves
#undef RETROGRADE_MOVE

std::span<const Move> all_moves() {
#define RETROGRADE_MOVE(name) Move{#name, moves::name, false, false, false},
#define RETROGRADE_MOVE_OF_PLACE(name) Move{#name, moves::name, true, false, false},
#define RETROGRADE_MOVE_OF_BITS(name) Move{#name, moves::name, true, true, false},
#define RETROGRADE_MOVE_ON_DEVICE(name) Move{#name, moves::name, true, false, true},
  static constexpr auto all = std::to_array<Move>({
#include "autoschedule/moves/list.def"
  });
#undef RETROGRADE_MOVE
  return all;
}

const Move* find_move(const std::string& name) {
  const std::span<const Move> all = all_moves();
  const auto found =
      std::ranges::find(all, name, [](const Move& m) { return std::string(m.name); });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace retrograde::planning
