// move_walk.h -- random moves on the plan of a random program: each plan on the way keeps the invariants, and the code
// of the last one computes what the interpreter does.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "autoschedule/cost/cost.h"
#include "autoschedule/moves/move.h"
#include "driver/plan_schedule.h"
#include "driver/schedule.h"
#include "graph/copy_graph.h"
#include "graph/directives/wrappers.h"
#include "graph/names.h"
#include "testing/check_program.h"
#include "testing/programs/large.h"

namespace retrograde::fuzz {

// How the price of a plan, after those of other plans, differs from that of a model that remembers nothing; empty: in no
// bit.
inline std::string price_difference(planning::CostModel& model, const planning::Plan& plan,
                                    const planning::Context& context) {
  planning::CostModel fresh(context.accesses, context.sizes, context.machine);
  const planning::Totals totals = model.totals(plan);
  const planning::Cost cost = model.price(plan), expected = fresh.price(plan);
  const auto is_equal = [](const planning::StageCost& a, const planning::StageCost& b) {
    return a.stage == b.stage && a.seconds == b.seconds && a.bytes == b.bytes;
  };
  const bool are_equal = totals.seconds == expected.seconds &&
                         totals.peak_bytes == expected.peak_bytes &&
                         std::ranges::equal(cost.stages, expected.stages, is_equal);
  return are_equal ? ""
                   : retrograde::text("a new model gives another price:\n", to_text(cost, plan),
                                      to_text(expected, plan), to_text(plan));
}

struct WalkOptions {
  int most_steps = 8;
  std::string preferred;  // a move that is taken more often than others
};

class MoveWalk {
 public:
  explicit MoveWalk(Choices& choices, WalkOptions options = {})
      : c_(choices), options_(std::move(options)), program_(made(choices)) {
    default_extent_ = c_.pick<int64_t>({7, 40, 1000});
    if (c_.chance(50)) machine_.levels[0].bytes = 1 << 10;
    if (c_.chance(50)) machine_.levels[1].bytes = 1 << 12;
    start();
  }

  // Until a plan breaks an invariant or no move gives one.
  void run() {
    const planning::AccessGraph accesses(plan_.program->outputs);
    const planning::SizeModel sizes(accesses, {default_extent_});
    planning::Dependences dependences(accesses);
    const planning::Context context{accesses, sizes, machine_, dependences};
    planning::Machine small = machine_;  // caches that a few rows fill
    for (size_t level = 0; level < 3; ++level)
      small.levels[level].bytes = static_cast<double>(1 << (10 + 2 * level));
    const planning::Context in_small{accesses, sizes, small, dependences};
    planning::CostModel cost(accesses, sizes, machine_), small_cost(accesses, sizes, small);
    const auto funcs = static_cast<int>(plan_.funcs.size());
    for (int step = c_.between(0, options_.most_steps); step > 0 && broken_.empty(); --step) {
      const auto id = static_cast<planning::FuncId>(c_.below(funcs));
      std::vector<Choice> possible;  // rare moves are as likely as others
      for (const planning::Move& move : planning::all_moves()) {
        Choice choice{&move, move.apply(plan_, id, context)};
        if (!choice.plans.empty()) possible.push_back(std::move(choice));
      }
      if (possible.empty()) continue;
      const auto preferred = std::ranges::find(possible, options_.preferred,
                                               [](const Choice& c) { return c.move->name; });
      const bool takes_preferred = preferred != possible.end() && c_.chance(50);
      const auto [move, plans] = takes_preferred ? *preferred : c_.pick(possible);
      for (const planning::Plan& after : plans) {
        check(after, *move, id);
        if (broken_.empty()) broken_ = price_difference(cost, after, context);
        if (broken_.empty()) broken_ = price_difference(small_cost, after, in_small);
      }
      if (!broken_.empty()) break;
      plan_ = c_.pick(plans);
      keeps_bits_ = keeps_bits_ && !move->changes_bits;
      trace_ += retrograde::text("\n", move->name, " of ", name_of(id), "\n", to_text(plan_));
      ++counts_[move->name];
    }
  }

  Judged judge(const Target& target) {
    Judged result{broken_.empty() ? Judgement::Right : Judgement::Broken, broken_};
    if (broken_.empty()) {
      result = judge(plan_, target);
      // A program whose first plan fails is no finding.
      if (result.judgement != Judgement::Right &&
          judge(first_, target).judgement != Judgement::Right)
        return {Judgement::Illegal, result.detail};
      if (result.judgement == Judgement::Refused) result.judgement = Judgement::Broken;
    }
    for (const auto& [move, count] : counts_) result.counts[move] += count;
    return result;
  }
  std::string text() const { return fuzz::to_text(program_) + trace_ + broken_; }

 private:
  struct Choice {
    const planning::Move* move;
    std::vector<planning::Plan> plans;
  };
  Choices& c_;
  const WalkOptions options_;
  const RandomProgram program_;
  std::vector<graph::FuncPtr> unscheduled_;
  int64_t default_extent_ = 0;
  planning::Machine machine_;
  planning::Plan first_, plan_;
  std::string trace_, broken_;
  std::map<std::string, uint64_t> counts_;
  bool keeps_bits_ = true;

  static RandomProgram made(Choices& choices) {
    const int kind = choices.below(6);
    if (kind == 0) return make_program(choices, Style::pipelines());
    if (kind == 1) return make_program(choices, Style::chains());
    if (kind == 2) return with_gradients(make_program(choices, Style::gradients()));
    if (kind == 3) return make_program(choices, Style::pieces());
    const RandomProgram large = make_large_program(choices, LargeSizes::Small);
    return kind == 4 ? large : with_gradients(large);
  }

  // The program and its gradients by all images.
  static RandomProgram with_gradients(RandomProgram program) {
    const Func output = program.output();
    if (output.outputs() != 1) return program;
    std::vector<AdjointInput> inputs;
    for (size_t i = 0; i < program.images.size(); ++i) inputs.push_back(program.image(i));
    Region bounds;
    for (size_t d = 0; d < program.region().mins.size(); ++d)
      bounds.push_back({program.region().mins[d], program.region().extents[d]});
    Func seed("seed");
    seed(output.args()) =
        output.args().empty() ? Expr(1.0f) : cast<float>(output.args()[0] % 3 + 1);
    const Derivative d = propagate_adjoints(output, seed, bounds, {.wrt = inputs});
    std::vector<oracle::Region> regions{program.region()};
    program.outputs = {output};
    for (size_t i = 0; i < inputs.size(); ++i) {
      const Func gradient = d.of(inputs[i]);
      if (!gradient.defined()) continue;
      program.outputs.push_back(gradient);
      regions.push_back(oracle::region_of(*program.images[i].raw_buffer()));
    }
    program.runs = {regions};
    return program;
  }

  // The plan of the default schedule, or of all Funcs at root without one.
  void start() {
    unscheduled_ = graph::copy_graph(graph::apply_wrappers(outputs_of(program_))).outputs;
    if (c_.chance(50)) {
      // The schedule of gradients is the one that compiling gives, with its rewrites.
      keeps_bits_ = false;
      const std::vector<graph::FuncPtr> outputs = driver::schedule_unscheduled(unscheduled_);
      plan_ = planning::import_plan(
          graph::apply_wrappers(driver::schedule_by_plan(graph::apply_wrappers(outputs), {},
                                                         driver::Scheduling::Everything)
                                    .outputs));
    } else {
      plan_ = planning::undecided_plan(planning::make_program(unscheduled_));
      for (auto& func : plan_.funcs) {
        planning::FuncPlan at_root = *func;
        if (at_root.opacity == planning::Opacity::None)
          at_root.placement.compute.kind = planning::Level::Kind::Root;
        func = std::make_shared<planning::FuncPlan>(at_root);
      }
    }
    first_ = plan_;
    trace_ = "\n" + to_text(plan_);
    broken_ = broken_invariant(plan_);
    if (!broken_.empty()) broken_ = "the first plan: " + broken_;
  }

  const std::string& name_of(planning::FuncId id) const {
    return plan_.program->funcs[static_cast<size_t>(id)]->name;
  }
  void check(const planning::Plan& after, const planning::Move& move, planning::FuncId id) {
    const std::string broken = broken_invariant(after);
    if (!broken.empty() && broken_.empty())
      broken_ =
          retrograde::text(move.name, " of ", name_of(id), ": ", broken, "\n", to_text(after));
  }

  Judged judge(const planning::Plan& plan, const Target& target) const {
    RandomProgram program = program_;
    program.outputs.clear();
    for (const graph::FuncPtr& output : planning::emit_plan(plan))
      program.outputs.emplace_back(output);
    const auto rounding =
        keeps_bits_ ? oracle::Rounding::Contraction : oracle::Rounding::Reordering;
    return check_with_schedule(
        program, [] {}, target, {[] {}}, Watch::Accesses, rounding);
  }
};

}  // namespace retrograde::fuzz
