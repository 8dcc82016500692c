// trainer_state.cpp -- see trainer_state.h.
#include "trainer_state.h"

#include "diagnostics/error.h"

namespace bilateral_slice {

using retrograde::quoted;
using retrograde::text;

namespace {

std::string array_name(size_t n) { return text("array", n); }

// States of earlier versions lack this entry: all groups move, in colour.
std::string word(const apps::State& state, const char* name, const std::string& otherwise) {
  const auto found = state.words.find(name);
  return found == state.words.end() ? otherwise : found->second;
}

void require_equal(const char* what, const std::string& own, const std::string& of_state,
                   const char* instead) {
  if (own == of_state) return;
  retrograde::call_error("resume with these options",
                         text("a run goes on with the same ", what, " that it began with"),
                         text("the state is of ", quoted(of_state), ", this run of ", quoted(own)),
                         instead);
}

}  // namespace

std::string names_of(const Groups& groups) {
  std::string names;
  const auto add = [&](bool moves, const char* name) {
    if (moves) names += (names.empty() ? "" : ",") + std::string(name);
  };
  add(groups.grid, "grid");
  add(groups.mix, "mix");
  add(groups.curve, "curve");
  return names;
}

apps::State state_of(const Trainer& trainer) {
  apps::State state;
  state.program = "bilateral_slice";
  state.step = trainer.steps();
  state.words["optimize"] = names_of(trainer.moves());
  state.words["channels"] = text(trainer.shape().channels);
  const auto buffers = trainer.state();
  for (size_t n = 0; n < buffers.size(); ++n) {
    if (buffers[n].defined())
      state.arrays[array_name(n)].assign(buffers[n].begin(), buffers[n].end());
  }
  return state;
}

void restore(Trainer& trainer, const apps::State& state) {
  auto buffers = trainer.state();
  for (size_t n = 0; n < buffers.size(); ++n) {
    if (!buffers[n].defined()) continue;
    const auto& from =
        state.array(array_name(n), static_cast<size_t>(buffers[n].number_of_elements()));
    size_t at = 0;
    for (float& value : buffers[n]) value = static_cast<float>(from[at++]);
  }
  trainer.set_steps(static_cast<int>(state.step));
}

void require_same_run(const apps::State& state, const Shape& shape, const Groups& moves) {
  require_equal("groups", names_of(moves), word(state, "optimize", names_of({})),
                "Give --optimize as the run that is resumed had it, or leave out --resume");
  require_equal("channels", text(shape.channels), word(state, "channels", "3"),
                "Give the photographs of the run that is resumed, or leave out --resume");
}

}  // namespace bilateral_slice
