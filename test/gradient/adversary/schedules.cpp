#include "gradient/adversary/schedules.h"

#include <algorithm>
#include <random>

#include "diagnostics/error.h"

namespace retrograde::gradient {

namespace {

class Scheduler {
 public:
  Scheduler(const std::vector<Func>& funcs, uint64_t seed) : funcs_(funcs), random_(seed) {}

  void run() {
    for (Func f : funcs_) {
      attempt([&] { choose_level(f); });
      for (int s = 0; s <= f.num_update_definitions(); ++s) {
        if (chance(50)) attempt([&] { choose_loops(f, s); });
      }
    }
  }

 private:
  int below(int n) { return static_cast<int>(random_() % static_cast<uint64_t>(n)); }
  bool chance(int percent) { return below(100) < percent; }
  template <typename F>
  static void attempt(const F& directive) {
    try {
      directive();
    } catch (const UserError&) {
    }
  }

  void choose_level(Func& f) {
    const int kind = below(10);
    const Func user = only_user(f);
    if (kind < 4) {
      f.compute_root();
      if (chance(15)) f.memoize();
    } else if (kind < 7 && user.defined() && user.dimensions() > 0) {
      f.compute_at(user, user.args()[static_cast<size_t>(below(user.dimensions()))]);
      if (chance(30)) f.store_root();
    } else if (kind == 7) {
      f.compute_inline();
    }
    if (f.dimensions() > 1 && chance(20)) f.reorder_storage({f.args()[1], f.args()[0]});
    if (f.dimensions() > 0 && chance(10)) f.align_storage(f.args()[0], 8);
  }
  // Undefined when there is none, or several.
  Func only_user(const Func& f) const {
    Func result;
    for (const Func& g : funcs_) {
      const auto callees = ir::direct_callees(*g.function());
      if (std::find(callees.begin(), callees.end(), f.function()) == callees.end()) continue;
      if (result.defined()) return Func();
      result = g;
    }
    return result;
  }

  std::vector<Var> pure_loops(const Func& f, int s) const {
    std::vector<Var> result;
    const std::vector<Var> args = f.args();
    for (size_t d = 0; d < args.size(); ++d) {
      if (s > 0) {
        const auto place = f.update_args(s - 1)[d].as<ir::Variable>();
        if (!place || place->name != args[d].name()) continue;
      }
      result.push_back(args[d]);
    }
    return result;
  }

  void choose_loops(Func& f, int s) {
    std::vector<Var> loops = pure_loops(f, s);
    if (loops.empty()) return;
    Stage stage = f.stage(s);
    if (loops.size() > 1 && chance(30)) {
      std::swap(loops[0], loops[1]);
      stage.reorder(loops[0], loops[1]);
    }
    const Var inner = loops[0];
    const int factor = std::vector<int>{2, 3, 4, 8}[static_cast<size_t>(below(4))];
    switch (below(5)) {
      case 0:
        stage.vectorize(inner, factor);
        break;
      case 1:
        stage.unroll(inner, factor);
        break;
      case 2: {
        Var outer, lanes;
        stage.split(inner, outer, lanes, factor).vectorize(lanes);
        break;
      }
      case 3:
        stage.vectorize(inner, factor, TailStrategy::GuardWithIf);
        break;
      default:
        break;
    }
    if (loops.size() > 1 && chance(60)) stage.parallel(loops.back());
  }

  const std::vector<Func>& funcs_;
  std::mt19937_64 random_;
};

}  // namespace

void schedule_at_random(const std::vector<Func>& funcs, uint64_t seed) {
  Scheduler(funcs, seed).run();
}

}  // namespace retrograde::gradient
