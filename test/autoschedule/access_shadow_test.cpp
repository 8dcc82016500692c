// The access graph in shadow: on many programs with their gradients, its answers are compared with those of the queries
// that the rules in compiler/autoschedule ask. A difference has a name and an explanation, or the test fails.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "analysis/linear.h"
#include "autoschedule/access/compose.h"
#include "autoschedule/access/sizes.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/read_estimate.h"
#include "autoschedule/read_window.h"
#include "autoschedule/size_estimate.h"
#include "autoschedule/stored_reads.h"
#include "gradient/programs_large.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/wrappers.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "simplify/simplify.h"
#include "support/program_counts.h"
#include "testing/programs/large.h"

namespace retrograde {
namespace {

using namespace graph;
using planning::Access;
using planning::AccessGraph;
using planning::IndexForm;
using planning::SizeModel;
using planning::SizeSource;
using planning::StageId;
using planning::StageNode;

// The explained differences.
enum class Difference : uint8_t {
  OnlyNewSize,      // a clamp to a parameter: SizeEstimate gives up, the form knows the loop
  GivenBeforeRead,  // SizeEstimate prefers the region read to the bound or estimate of the user
  OnlyOldSize,      // the bounds of a whole index, in which unknown loops cancel
  BeyondBorder,     // the form of a mirror reads all inside of the border once it reads beyond
  OnlyNewRegion,    // SizeEstimate takes all inside of a clamp where it does not know the loops
  Cancelled,  // uses_variable() sees a variable that moves the index by a multiple of its modulus
  OldWindowOnly,  // read_window() takes remainders inside of sums as ranges; they are opaque terms of forms
  NewWindowOnly,  // read_window() gives up, or is wider: forms keep quotients, clamps and promises
  EmptyLoop,      // a reduction without iterations reads nothing, in different ways
  Folded,         // inlining expressions folds constant conditions, and with them reads
  count
};
using Differences = std::array<int, size_t(Difference::count)>;

class Shadow {
 public:
  explicit Shadow(const std::vector<FuncPtr>& outputs)
      : outputs_(apply_wrappers(outputs)),
        graph_(outputs),
        old_sizes_(outputs_),
        sizes_(graph_, {1024}) {}

  void compare() {
    for (const planning::FuncNode& node : graph_.funcs()) {
      compare_sizes(node);
      for (const StageNode& stage : node.stages) {
        if (node.func->is_extern()) continue;
        compare_reads(stage, calls_of(roots_of(stage)), stage.reads, false);
      }
    }
    compare_inlined();
  }

  const Differences& differences() const { return differences_; }
  int equal_answers() const { return equal_; }

 private:
  void differ(Difference kind) { ++differences_[static_cast<size_t>(kind)]; }

  // ---- sizes ----

  void compare_sizes(const planning::FuncNode& node) {
    const FuncContents& f = *node.func;
    const planning::FuncId id = graph_.find(&f);
    for (size_t d = 0; d < f.args.size(); ++d) {
      const auto known = old_sizes_.extent(f, d);
      const planning::Extent extent = sizes_.of(id, d);
      const bool is_given =
          extent.source == SizeSource::Bound || extent.source == SizeSource::Estimate;
      if (!known && extent.is_known()) {
        differ(Difference::OnlyNewSize);
      } else if (known && *known != extent.estimate && is_given) {
        differ(Difference::GivenBeforeRead);
      } else if (known && *known != extent.estimate && has_empty_loop()) {
        differ(Difference::EmptyLoop);
      } else if (known && extent.source == SizeSource::Default) {
        differ(Difference::OnlyOldSize);
      } else if (known && *known < extent.estimate) {
        differ(Difference::BeyondBorder);
      } else if (known && *known > extent.estimate) {
        differ(Difference::OnlyNewRegion);
      } else if (known) {
        ++equal_;
      }
    }
  }

  static bool is_empty(const StageNode& stage, const SizeModel& sizes) {
    for (size_t i = 0; i < stage.iterators.size(); ++i)
      if (sizes.of(stage.id, static_cast<int>(i)).estimate == 0) return true;
    return false;
  }
  bool has_empty_loop() const {
    return std::ranges::any_of(graph_.funcs(), [&](const planning::FuncNode& node) {
      return std::ranges::any_of(node.stages,
                                 [&](const StageNode& stage) { return is_empty(stage, sizes_); });
    });
  }

  // ---- reads ----

  std::vector<Expr> roots_of(const StageNode& stage) const {
    std::vector<Expr> roots;
    for_each_expr(definition(stage), [&](const Expr& e) { roots.push_back(without_lets(e)); });
    return roots;
  }
  const Definition& definition(const StageNode& stage) const {
    return graph_.func(stage.id.func).func->stage(stage.id.stage);
  }

  static std::vector<const Call*> calls_of(const std::vector<Expr>& roots) {
    std::vector<const Call*> calls;
    for (const Expr& root : roots) {
      walk(root, [&](const Call& call) {
        if (call.call_type == CallType::Func || call.call_type == CallType::Image)
          calls.push_back(&call);
      });
    }
    return calls;
  }

  using Window = std::tuple<std::string, double, double, double>;
  using Source = const Symbol*;

  const Symbol* source_of(const Access& access) const {
    return access.of >= 0 ? static_cast<const Symbol*>(graph_.func(access.of).func.get())
                          : graph_.images()[static_cast<size_t>(access.image)].get();
  }

  bool moves(const Expr& e, const StageNode& stage) const {
    return std::ranges::any_of(
        stage.iterators, [&](const planning::Iterator& i) { return uses_variable(e, i.name); });
  }

  // As read_window() has it: one pure loop, with the reductions over constant ranges in the window.
  std::optional<Window> window_of(const IndexForm& form, const StageNode& stage) const {
    if (form.modulus != 0) return Window{"", 0, 0, static_cast<double>(form.modulus - 1)};
    Window result{"", 0, static_cast<double>(form.low), static_cast<double>(form.high)};
    auto& [loop, scale, low, high] = result;
    if (!form.opaque.empty()) return std::nullopt;
    for (const planning::Term& term : form.terms) {
      const planning::Iterator& i = stage.iterators[static_cast<size_t>(term.iterator)];
      const auto by = static_cast<double>(term.coefficient);
      if (i.kind == planning::Iterator::Kind::Pure) {
        if (!loop.empty()) return std::nullopt;
        loop = i.name;
        scale = by;
        continue;
      }
      const planning::Extent extent = sizes_.of(stage.id, term.iterator);
      if (!extent.is_constant()) return std::nullopt;
      const ir::ConstantRange range = sizes_.range(stage.id, term.iterator);
      const auto min = static_cast<double>(range.min), max = static_cast<double>(range.max);
      low += std::min(by * min, by * max);
      high += std::max(by * min, by * max);
    }
    const auto divisor = static_cast<double>(form.divisor);
    scale /= divisor;
    low = (low - (divisor - 1)) / divisor;
    high /= divisor;
    return rounded(loop, scale, low, high);
  }

  // Windows of the two are the same number, computed in another order.
  static Window rounded(const std::string& loop, double scale, double low, double high) {
    const auto round = [](double x) { return std::round(x * 1e6) / 1e6 + 0.0; };
    return {loop, round(scale), round(low), round(high)};
  }

  void compare_reads(const StageNode& stage, const std::vector<const Call*>& calls,
                     const std::vector<Access>& reads, bool is_inlined) {
    std::map<std::pair<Source, size_t>, std::set<planning::IteratorSet>> old_moved, moved;
    std::map<std::pair<Source, size_t>, std::set<Window>> old_windows, windows;
    std::set<std::pair<Source, size_t>> unknown_windows;
    const FuncContents& f = *graph_.func(stage.id.func).func;
    for (const Call* call : calls) {
      for (size_t d = 0; d < call->args.size(); ++d) {
        planning::IteratorSet set = 0;
        for (size_t i = 0; i < stage.iterators.size(); ++i)
          if (uses_variable(call->args[d], stage.iterators[i].name))
            set |= planning::set_of(int(i));
        old_moved[{call->symbol.raw(), d}].insert(set);
        if (const auto w = autoschedule::read_window(call->args[d], f, definition(stage)))
          old_windows[{call->symbol.raw(), d}].insert(rounded(w->loop, w->scale, w->low, w->high));
      }
    }
    for (const Access& read : reads) {
      for (size_t d = 0; d < read.index.size(); ++d) {
        moved[{source_of(read), d}].insert(read.index[d].moved_by());
        if (const auto w = window_of(read.index[d], stage))
          windows[{source_of(read), d}].insert(*w);
        else
          unknown_windows.insert({source_of(read), d});
      }
    }
    for (const auto& [place, sets] : moved) {
      if (old_moved.contains(place))
        compare_sets(old_moved[place], sets, f.name, is_inlined);
      else if (is_inlined)
        differ(Difference::Folded);
      else
        ADD_FAILURE() << f.name << " has a read that its definition lacks";
    }
    for (const auto& [place, sets] : old_moved)
      EXPECT_TRUE(moved.contains(place)) << f.name << " lacks a read";
    for (const auto& [place, set] : old_windows)
      compare_windows(set, windows[place], unknown_windows.contains(place), stage);
    for (const auto& [place, set] : windows)
      for (const Window& w : set)
        if (!old_windows[place].contains(w)) differ(Difference::NewWindowOnly);
  }

  void compare_sets(const std::set<planning::IteratorSet>& old_sets,
                    const std::set<planning::IteratorSet>& sets, const std::string& name,
                    bool is_inlined) {
    for (const planning::IteratorSet set : sets) {
      const bool is_part = std::ranges::any_of(
          old_sets, [&](planning::IteratorSet old) { return (set & ~old) == 0; });
      EXPECT_TRUE(is_part || is_inlined) << name << ": variables that the index does not use";
      if (old_sets.contains(set))
        ++equal_;
      else if (!is_part)
        differ(Difference::Folded);
      else
        differ(Difference::Cancelled);
    }
  }

  void compare_windows(const std::set<Window>& old_windows, const std::set<Window>& windows,
                       bool has_unknown, const StageNode& stage) {
    const std::string& name = graph_.func(stage.id.func).func->name;
    for (const Window& w : old_windows) {
      if (windows.contains(w)) {
        ++equal_;
        continue;
      }
      const auto& [loop, scale, low, high] = w;
      if (low > high || is_empty(stage, sizes_)) {
        differ(Difference::EmptyLoop);
        continue;
      }
      // A form that is as good or better: the same loop, no wider.
      const bool is_tighter = std::ranges::any_of(windows, [&](const Window& n) {
        return std::get<0>(n) == loop && std::get<1>(n) == scale && std::get<2>(n) >= low &&
               std::get<3>(n) <= high;
      });
      const bool is_cancelled = std::ranges::any_of(
          windows, [&](const Window& n) { return std::get<3>(n) - std::get<2>(n) <= high - low; });
      if (is_tighter || is_cancelled)
        differ(Difference::NewWindowOnly);
      else if (has_unknown)
        differ(Difference::OldWindowOnly);
      else
        ADD_FAILURE() << name << ": window " << loop << " * " << scale << " + [" << low << ", "
                      << high << "]\n"
                      << planning::print(graph_);
    }
  }

  // ---- reads through inlined Funcs ----

  void compare_inlined() {
    std::vector<bool> inlined;
    for (const planning::FuncNode& node : graph_.funcs())
      inlined.push_back(!node.is_output && autoschedule::is_computed_inline(node.func, {}));
    const planning::ComposedReads composed(graph_, inlined, 1 << 16);
    const autoschedule::StoredReads stored(outputs_);
    std::map<Source, std::set<StageId>> old_readers, readers;
    for (const planning::FuncNode& node : graph_.funcs()) {
      for (const autoschedule::StoredRead& read : stored.of(node.func))
        old_readers[node.func.get()].insert(
            {graph_.find(read.reader.get()), static_cast<int16_t>(read.stage)});
    }
    for (const planning::FuncNode& node : graph_.funcs()) {
      for (const StageNode& stage : node.stages) {
        if (inlined[static_cast<size_t>(stage.id.func)] || node.func->is_extern()) continue;
        EXPECT_TRUE(composed.is_complete(stage.id)) << node.func->name;
        for (const Access& read : composed.of(stage.id))
          if (read.of >= 0 && read.of != stage.id.func) readers[source_of(read)].insert(stage.id);
        compare_composed(stage, composed.of(stage.id));
      }
    }
    for (const auto& [source, stages] : readers) {
      const auto id = graph_.find(source);
      if (stored.is_hidden(graph_.func(id).func))
        continue;  // of too many calls the old one knows some
      EXPECT_TRUE(std::ranges::includes(stages, old_readers[source])) << graph_.func(id).func->name;
      if (stages == old_readers[source])
        ++equal_;
      else
        differ(Difference::Folded);
    }
  }

  void compare_composed(const StageNode& stage, const std::vector<Access>& reads) {
    const std::vector<Expr> roots = autoschedule::roots_with_inlined(definition(stage));
    const std::vector<const Call*> calls = calls_of(roots);
    const bool is_cut = std::ranges::any_of(calls, [](const Call* call) {
      return call->call_type == CallType::Func &&
             autoschedule::is_computed_inline(func_of(*call), {});
    });
    if (!is_cut) compare_reads(stage, calls, reads, true);
  }

  const std::vector<FuncPtr> outputs_;
  const AccessGraph graph_;
  const autoschedule::SizeEstimate old_sizes_;
  const SizeModel sizes_;
  Differences differences_{};
  int equal_ = 0;
};

class Totals {
 public:
  void add(const std::vector<FuncPtr>& outputs, const std::string& name) {
    SCOPED_TRACE(name);
    Shadow shadow(outputs);
    shadow.compare();
    equal += shadow.equal_answers();
    for (size_t i = 0; i < differences.size(); ++i) differences[i] += shadow.differences()[i];
  }
  // `most`: of each difference for a thousand equal answers.
  void expect(const Differences& most) const {
    for (size_t i = 0; i < differences.size(); ++i)
      EXPECT_LE(1000 * differences[i], most[i] * equal) << "difference " << i;
    EXPECT_GT(equal, 800);
  }

 private:
  int equal = 0;
  Differences differences{};
};

std::vector<FuncPtr> with_gradients(const gradient::Program& program) {
  std::vector<FuncPtr> outputs{program.loss.function()};
  Derivative d = propagate_adjoints(program.loss);
  for (const Buffer<float>& input : program.inputs) outputs.push_back(d(input).function());
  return outputs;
}

TEST(AccessGraphInShadow, AgreesOnTheGradientSuite) {
  Totals totals;
  for (const gradient::NamedProgram& program : gradient::programs())
    totals.add(with_gradients(program.build()), program.name);
  totals.expect({0, 3, 0, 0, 0, 1, 5, 7, 0, 1});
}

TEST(AccessGraphInShadow, AgreesOnLargePrograms) {
  Totals totals;
  for (const gradient::LargeProgram& program : gradient::large_programs())
    totals.add(with_gradients(program.build(gradient::test_side)), program.name);
  totals.expect({0, 0, 0, 0, 0, 0, 0, 21, 0, 0});
}

TEST(AccessGraphInShadow, AgreesOnRandomPrograms) {
  Totals totals;
  for (int seed = 0; seed < many_or_few(400, 60); ++seed) {
    fuzz::Choices choices(static_cast<uint64_t>(seed)), more(static_cast<uint64_t>(seed));
    const auto pipeline = fuzz::make_program(choices, fuzz::Style::pipelines());
    totals.add(fuzz::outputs_of(pipeline), "pipeline " + std::to_string(seed));
    const auto large = fuzz::make_large_program(more, fuzz::LargeSizes::Full);
    totals.add(fuzz::outputs_of(large), "large program " + std::to_string(seed));
  }
  totals.expect({1, 0, 1, 1, 3, 3, 12, 40, 5, 2});
}

}  // namespace
}  // namespace retrograde
