// Loops over time: checkpointing.
//
// A simulation of n steps overwrites its state n times, and the backward pass needs every state. Storing
// all of them takes the memory of n states. Storing a few and recomputing the steps between them takes time
// instead, but less than one might expect. The gradient has the same bits in either case.
#include <retrograde/retrograde.h>

#include <cmath>

#include "tutorial.h"

using namespace retrograde;

const int pendulums = 16, steps = 200;

// Pendulums that start at the angles `start`. The loss is the squared distance of the final angles from `wanted`.
Func miss(const Buffer<float>& start, const Buffer<float>& wanted) {
  Var x("x");
  Func state("state"), loss("loss");
  RDom t(0, steps), all(0, pendulums);
  state(x) = Tuple(start(x), 0.0f);  // angle and speed
  Expr speed = state(x)[1] - 0.015625f * sin(state(x)[0]) + 0.0f * cast<float>(t);
  state(x) = Tuple(state(x)[0] + 0.015625f * speed, speed);
  loss() = 0.0f;
  loss() += pow(state(all)[0] - wanted(all), 2);
  return loss;
}

int main(int argc, char** argv) {
  Buffer<float> start(pendulums), wanted(pendulums);
  for (int i = 0; i < pendulums; ++i) {
    start(i) = 0.5f + 0.0625f * static_cast<float>(i);
    wanted(i) = 0.25f - 0.03125f * static_cast<float>(i);
  }
  auto gradient_with = [&](const AdjointOptions& options) {
    return propagate_adjoints(miss(start, wanted), options);
  };

  // ---- All states or a few: the gradient has the same bits. ----
  Buffer<float> all =
      gradient_with({.overwritten = Overwritten::Store})(start).realize({pendulums});
  std::vector<double> works, memories;
  bool same = true;
  for (int states : {1, 2, 4, 8, 16, 32}) {
    Derivative d = gradient_with({.checkpoint_states = states});
    Buffer<float> few = d(start).realize({pendulums});
    for (int i = 0; i < pendulums; ++i) same = same && few(i) == all(i);
    works.push_back(*d.operations().gradient.operations().value());
    memories.push_back(*d.operations().gradient.bytes().value());
    std::printf("%2d states: %9.0f operations, %7.0f bytes\n", states, works.back(),
                memories.back());
  }
  claim(same, "1 to 32 stored states of 200 give the same bits as storing all");

  // ---- The cost: s states need r n - C(s + r, r - 1) recomputed steps (docs/derivatives.md). ----
  claim(works[5] < works[2] && works[2] < works[0], "more states, fewer recomputed steps");
  claim(memories[0] < memories[2] && memories[2] < memories[5], "and more memory");
  claim(works[3] < works[0] / 8,
        "eight states already save seven eighths of the operations of one state");

  // ---- A budget in bytes works the same way: it holds as many states as fit. ----
  Derivative within = gradient_with({.checkpoint_bytes = 4096});
  Buffer<float> budget = within(start).realize({pendulums});
  for (int i = 0; i < pendulums; ++i) same = same && budget(i) == all(i);
  claim(same, "a budget in bytes gives the same bits");

  // ---- An application: where must the pendulums start to end where we want them? ----
  Func loss = miss(start, wanted);
  Func gradient = propagate_adjoints(loss, {.checkpoint_states = 8})(start);
  std::vector<double> losses;
  for (int n = 0; n < 40; ++n) {
    losses.push_back(Buffer<float>(loss.realize())());
    Buffer<float> g = gradient.realize({pendulums});
    for (int i = 0; i < pendulums; ++i) start(i) -= 0.4f * g(i);
  }
  claim(losses.back() < 0.01 * losses.front(),
        "forty steps of descent bring the loss below a hundredth");

  Picture picture("Cost of a gradient over 200 steps, by number of stored states");
  std::vector<double> logs;
  for (double w : works) logs.push_back(std::log10(w));
  picture.curve("log10 of operations", logs, std::log10(works.back()) - 0.2,
                std::log10(works[0]) + 0.2);
  logs.clear();
  for (double m : memories) logs.push_back(std::log10(m));
  picture.curve("log10 of bytes", logs, logs.front() - 0.2, logs.back() + 0.2);
  picture.write(argc, argv, "loops_over_time");
}
