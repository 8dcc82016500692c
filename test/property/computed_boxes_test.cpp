// The boxes that Covers gives for Funcs in loops are those that compiled programs compute: random chains of stencils at
// changing resolution, in random places, trace what they produce.
#include <gtest/gtest.h>

#include <map>
#include <mutex>
#include <set>

#include "autoschedule/plan/covers.h"
#include "graph/directives/wrappers.h"
#include "retrograde/retrograde.h"
#include "support/program_counts.h"
#include "testing/choices.h"

namespace retrograde {
namespace {

using planning::FuncId;

class Chain {
 public:
  explicit Chain(fuzz::Choices& choices) : choices_(choices) {
    const size_t count = number(2, 6);
    for (size_t i = 0; i < count; ++i) {
      Func next("f" + std::to_string(i));
      next(x_, y_) = i == 0 ? cast<float>(x_ + 2 * y_) : values(i);
      if (i > 0 && choices.chance(25)) {
        RDom r(0, choices.between(1, 4), "r");
        next(x_, y_) += funcs_[i - 1](x_ + r, y_ - r);
      }
      if (choices.chance(10)) next(x_, choices.between(0, 3)) += 1.0f;
      funcs_.push_back(next);
    }
    funcs_.back().bound(x_, 0, 64).bound(y_, 0, 32);
    around_[count - 1] = {count - 1};
    loops_[count - 1] = split(funcs_.back().compute_root());
    for (size_t i = count - 1; i-- > 0;) place(i);
  }
  Func& output() { return funcs_.back(); }

 private:
  size_t number(int least, int most) { return static_cast<size_t>(choices_.between(least, most)); }

  Expr index(const Var& v, int scale) {
    const int k = choices_.between(-2, 2);
    return scale == 2 ? 2 * v + k : scale == 1 ? v + k : (v + k) / 2;
  }
  Expr values(size_t i) {
    Expr sum = 0.0f;
    const size_t sources = i > 1 && choices_.chance(30) ? 2 : 1;
    for (size_t s = 1; s <= sources; ++s) {
      const int scale_x = choices_.between(0, 2), scale_y = choices_.between(0, 2);
      for (size_t tap = number(1, 3); tap > 0; --tap)
        sum += funcs_[i - s](index(x_, scale_x), index(y_, scale_y));
      readers_[i - s].insert(i);
    }
    return sum;
  }

  // Inlined, in a loop of the only consumer that is not inlined, in the outermost loop of a Func around all consumers, or
  // at root.
  void place(size_t i) {
    Func& f = funcs_[i];
    for (const size_t reader : readers_[i]) around_[i].merge(std::set(around_[reader]));
    const bool may_inline = !f.has_update_definition() && readers_[i].size() == 1;
    if (may_inline && choices_.chance(25)) {
      inlined_.insert(i);
      return;
    }
    size_t host = *around_[i].begin();
    bool is_inside = around_[i].size() == 1 && choices_.chance(80);
    std::vector<Var> loops{y_};
    if (is_inside && !loops_[host].empty()) loops = {loops_[host].back()};
    size_t reader = *readers_[i].begin();
    bool has_one_reader = readers_[i].size() == 1;
    while (has_one_reader && inlined_.contains(reader)) {
      has_one_reader = readers_[reader].size() == 1;
      reader = *readers_[reader].begin();
    }
    if (is_inside && has_one_reader && choices_.chance(80)) {
      host = reader;
      loops = loops_[host];
    }
    is_inside = is_inside && !funcs_[host].has_update_definition();
    if (is_inside) {
      f.compute_at(funcs_[host], loops[number(0, static_cast<int>(loops.size()) - 1)]);
      loops_[i] = {x_, y_};
    } else {
      loops_[i] = split(f.compute_root());
      around_[i] = {i};
    }
  }
  std::vector<Var> split(Func& f) {
    Var xi("xi"), yi("yi");
    if (choices_.chance(50)) {
      f.split(x_, x_, xi, 8);
      return {xi, x_, y_};
    }
    f.tile(x_, y_, xi, yi, 16, 8);
    return {xi, yi, x_, y_};
  }

  fuzz::Choices& choices_;
  const Var x_{"x"}, y_{"y"};
  std::vector<Func> funcs_;
  std::map<size_t, std::set<size_t>> readers_, around_;  // Funcs at root around all uses of a Func
  std::map<size_t, std::vector<Var>> loops_;
  std::set<size_t> inlined_;
};

// The largest extents that a run produces of each Func.
struct Produced : JITUserContext {
  std::mutex mutex;
  std::map<std::string, std::vector<int64_t>> extents;
};

int32_t note(JITUserContext* context, const halide_trace_event_t* e) {
  auto& produced = *static_cast<Produced*>(context);
  const std::lock_guard lock(produced.mutex);
  if (e->event != halide_trace_produce) return 1;
  std::vector<int64_t>& largest = produced.extents[e->func];
  largest.resize(static_cast<size_t>(e->dimensions / 2));
  for (size_t d = 0; d < largest.size(); ++d)
    largest[d] = std::max<int64_t>(largest[d], e->coordinates[2 * d + 1]);
  return 1;
}

struct Counts {
  int boxes = 0, equal = 0, near = 0;

  void add(Chain& chain) {
    const auto outputs = graph::apply_wrappers({chain.output().function()});
    for (const auto& f : graph::topological_order(outputs)) Func(f).trace_realizations();
    Produced produced;
    produced.handlers.custom_trace = note;
    chain.output().realize(&produced, {64, 32});
    const planning::Plan plan = planning::import_plan(outputs);
    const planning::AccessGraph graph(outputs);
    const planning::SizeModel sizes(graph, {1000});
    planning::Covers covers(plan, sizes);
    for (FuncId id = 0; id < static_cast<FuncId>(plan.funcs.size()); ++id) {
      const planning::Level& level = plan.of(id).placement.compute;
      if (level.kind != planning::Level::Kind::At) continue;
      const auto box = covers.box(id, level);
      const auto& actual = produced.extents[graph.func(id).func->name];
      ASSERT_EQ(box.size(), actual.size());
      ++boxes;
      equal += box == actual;
      const auto is_near = [](int64_t a, int64_t b) { return std::abs(a - b) <= 1; };
      near += std::ranges::equal(box, actual, is_near);
    }
  }
};

TEST(ComputedBoxes, AreThoseThatCompiledProgramsProduce) {
  Counts counts;
  for (int seed = 1; seed <= many_or_few(400, 60); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    fuzz::Choices choices(static_cast<uint64_t>(seed));
    Chain chain(choices);
    counts.add(chain);
  }
  // Where an index is divided, tails and boxes of boxes may begin anywhere.
  std::cout << counts.equal << " of " << counts.boxes << " boxes are equal, " << counts.near
            << " nearly\n";
  EXPECT_GT(counts.boxes, 30);
  EXPECT_GE(counts.equal, 0.9 * counts.boxes);
  EXPECT_GE(counts.near, 0.97 * counts.boxes);
}

}  // namespace
}  // namespace retrograde
