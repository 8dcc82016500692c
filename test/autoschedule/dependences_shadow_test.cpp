// Dependences in shadow: on many programs with their gradients, the iterations that may run at once are those that the
// rules of directives allow, which solve exact conditions; and orders that forms keep are legal. Forms decide most.
#include <gtest/gtest.h>

#include <algorithm>

#include "autoschedule/access/dependences.h"
#include "gradient/programs_large.h"
#include "graph/definitions/race_checks.h"
#include "graph/directives/wrappers.h"
#include "ir/build.h"
#include "support/program_counts.h"
#include "testing/programs/large.h"

namespace retrograde {
namespace {

using namespace planning;

struct Verdicts {
  int independent = 0, only_rules = 0,
      only_forms = 0;  // by both, by the rules alone, by forms alone
  int carried = 0;
  int orders = 0, orders_by_rules = 0, orders_by_forms = 0;  // in the same way

  void add(const std::vector<FuncPtr>& outputs, const std::string& program) {
    SCOPED_TRACE(program);
    const std::vector<FuncPtr> wrapped = apply_wrappers(outputs);
    const AccessGraph graph(wrapped);
    Dependences dependences(graph);
    for (const FuncNode& node : graph.funcs()) {
      for (size_t s = 1; s < node.stages.size(); ++s) {
        compare(dependences, node, node.stages[s]);
        compare_orders(dependences, node, node.stages[s]);
      }
    }
  }

  void compare(Dependences& dependences, const FuncNode& node, const StageNode& stage) {
    const StageDependences& forms = dependences.of(stage.id);
    const Definition& update = node.func->stage(stage.id.stage);
    IteratorSet around = 0;
    std::unordered_set<std::string> names;
    for (size_t i = stage.iterators.size(); i-- > 0;) {
      const planning::Iterator& iterator = stage.iterators[i];
      if (iterator.kind == planning::Iterator::Kind::Pure) continue;
      const bool is_points = point_number(update) && i + 1 == stage.iterators.size();
      if (is_points) continue;
      for (const bool is_inside : {false, true}) {
        const IteratorSet outside = is_inside ? around : 0;
        const bool by_forms = forms.are_independent(static_cast<int>(i), outside);
        const bool by_rules =
            can_prove_race_free(*node.func, update, iterator.name,
                                is_inside ? names : std::unordered_set<std::string>());
        EXPECT_EQ(dependences.may_run_at_once(stage.id, static_cast<int>(i), outside), by_rules)
            << node.func->name << " over " << iterator.name;
        independent += by_forms && by_rules;
        only_rules += by_rules && !by_forms;
        only_forms += by_forms && !by_rules;
        carried += !by_forms && !by_rules;
      }
      around |= set_of(static_cast<int>(i));
      names.insert(iterator.name);
    }
  }

  // All orders of the reduction variables.
  void compare_orders(Dependences& dependences, const FuncNode& node, const StageNode& stage) {
    const Definition& update = node.func->stage(stage.id.stage);
    if (point_number(update) || update.rvars.size() < 2 || dependences.commutes(stage.id)) return;
    const auto before = ir::mapped(update.rvars, &ReductionVariable::var);
    std::vector<int> order;
    for (size_t i = 0; i < stage.iterators.size(); ++i) {
      if (stage.iterators[i].kind == planning::Iterator::Kind::Reduction)
        order.push_back(static_cast<int>(i));
    }
    do {
      std::vector<LoopStep> loops;
      std::vector<std::string> after;
      for (const int i : order) {
        loops.insert(loops.begin(), LoopStep{i});
        after.push_back(stage.iterators[static_cast<size_t>(i)].name);
      }
      const bool by_forms =
          std::ranges::all_of(dependences.of(stage.id).all(),
                              [&](const planning::Dependence& d) { return keeps(d, loops); });
      const bool by_rules = can_prove_same_order(*node.func, update, before, after);
      orders += by_forms && by_rules;
      orders_by_rules += by_rules && !by_forms;
      orders_by_forms += by_forms && !by_rules;
    } while (std::ranges::next_permutation(order).found);
  }

  // The forms find most of what the rules find.
  void expect_most_by_forms() const {
    EXPECT_GT(independent, 5 * only_rules);
    EXPECT_LE(100 * only_forms, independent);
    EXPECT_GT(orders, 5 * orders_by_rules);
    EXPECT_LE(100 * orders_by_forms, orders);
    EXPECT_GT(carried, independent);
  }
};

std::vector<FuncPtr> loss_with_gradients(const gradient::Program& program) {
  std::vector<FuncPtr> outputs{program.loss.function()};
  Derivative d = propagate_adjoints(program.loss);
  for (const Buffer<float>& input : program.inputs) outputs.push_back(d(input).function());
  return outputs;
}

TEST(DependencesInShadow, AreThoseOfTheRulesInTheGradientSuite) {
  Verdicts verdicts;
  for (const gradient::NamedProgram& program : gradient::programs())
    verdicts.add(loss_with_gradients(program.build()), program.name);
  verdicts.expect_most_by_forms();
}

TEST(DependencesInShadow, AreThoseOfTheRulesInLargePrograms) {
  Verdicts verdicts;
  for (const gradient::LargeProgram& program : gradient::large_programs())
    verdicts.add(loss_with_gradients(program.build(gradient::test_side)), program.name);
  verdicts.expect_most_by_forms();
}

TEST(DependencesInShadow, AreThoseOfTheRulesInRandomPrograms) {
  Verdicts verdicts;
  for (int seed = 0; seed < many_or_few(400, 60); ++seed) {
    fuzz::Choices choices(static_cast<uint64_t>(seed)), more(static_cast<uint64_t>(seed));
    verdicts.add(fuzz::outputs_of(fuzz::make_program(choices, fuzz::Style::pipelines())),
                 "pipeline " + std::to_string(seed));
    verdicts.add(fuzz::outputs_of(fuzz::make_large_program(more, fuzz::LargeSizes::Full)),
                 "large program " + std::to_string(seed));
  }
  verdicts.expect_most_by_forms();
}

}  // namespace
}  // namespace retrograde
