#include "lower/nests/own_joining.h"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "diagnostics/error.h"
#include "graph/definitions/define.h"
#include "graph/definitions/own_reads.h"
#include "ir/equal.h"
#include "ir/print.h"
#include "ir/text.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

// A loop that covers a part of a dimension: the splits from the dimension down to the loop.
struct PartOfDimension {
  struct Step {
    const Split* split;
    bool is_outer;
  };
  std::string dimension;
  std::vector<Step> steps;
};

// nullopt if a fused loop runs over several dimensions.
std::optional<PartOfDimension> part_along(const StageLoops& schedule, const std::string& loop) {
  PartOfDimension part{loop, {}};
  for (auto split = schedule.splits.rbegin(); split != schedule.splits.rend(); ++split) {
    const bool is_outer = split->outer == part.dimension;
    const bool is_inner = split->kind != Split::Kind::Rename && split->inner == part.dimension;
    if (split->kind == Split::Kind::Fuse) {
      if (split->old_var == part.dimension) return std::nullopt;
    } else if (is_outer || is_inner) {
      if (split->kind == Split::Kind::Split) part.steps.push_back({&*split, is_outer});
      part.dimension = split->old_var;
    }
  }
  std::reverse(part.steps.begin(), part.steps.end());
  return part;
}

bool is_same(const PartOfDimension& a, const PartOfDimension& b) {
  return a.dimension == b.dimension &&
         std::equal(a.steps.begin(), a.steps.end(), b.steps.begin(), b.steps.end(),
                    [](const PartOfDimension::Step& s, const PartOfDimension::Step& t) {
                      return s.is_outer == t.is_outer &&
                             equal(simplify(s.split->factor), simplify(t.split->factor));
                    });
}

bool may_overlap(const Split& split) {
  switch (split.tail) {
    case TailStrategy::RoundUp:
    case TailStrategy::RoundUpAndBlend:
    case TailStrategy::ShiftInwards:
    case TailStrategy::ShiftInwardsAndBlend:
      return split.kind == Split::Kind::Split;
    default:
      return false;
  }
}

class OwnJoiningCheck {
 public:
  OwnJoiningCheck(const Program& program, const Joining& joining)
      : f_(program.funcs[joining.func]),
        depth_(joining.depth),
        own_(f_.stages[joining.stage]),
        before_(f_.stages[joining.with_stage]),
        asked_(text("compute ", quoted(stage_name(*f_.func, joining.stage)), " with ",
                    quoted(stage_name(*f_.func, joining.with_stage)), " down to its loop ",
                    quoted(own_.schedule.fuse_level.var))) {}

  void run() const {
    if (!before_.schedule.specializations.empty())
      refuse(text("the stage before has ", before_.schedule.specializations.size(),
                  " specializations, whose loops may be others"),
             "Specialize neither stage, or drop compute_with");
    check_stays_in_place();
    for (int d = 1; d <= depth_; d++) check_loop(loop_at(own_, d));
    for (const Split& split : before_.schedule.splits) {
      if (!may_overlap(split)) continue;
      refuse(text("the split of ", quoted(split.old_var),
                  " in the stage before lets tiles overlap, or run past their end"),
             "Split it with TailStrategy::GuardWithIf");
    }
  }

 private:
  const LoopedFunc& f_;
  const int depth_;
  const Definition &own_, &before_;
  const std::string asked_;

  static const std::string& loop_at(const Definition& stage, int depth) {
    const std::vector<Dim>& dims = stage.schedule.dims;
    return dims[dims.size() - static_cast<size_t>(depth)].var;
  }

  [[noreturn]] void refuse(const std::string& evidence, const std::string& advice) const {
    user_error(asked_,
               "stages of one Func that share loops touch the same elements in each iteration",
               evidence, advice);
  }

  // Whether the shared loops run along pure dimensions of the update. It accesses the elements of the iteration along
  // these, since its own reads keep pure positions, and of all other dimensions the stage before computes the whole range
  // in each iteration.
  bool shares_pure_dimensions() const {
    for (int d = 1; d <= depth_; d++) {
      const auto part = part_along(own_.schedule, loop_at(own_, d));
      const auto& args = f_.func->args;
      const auto arg = part ? std::ranges::find(args, part->dimension) : args.end();
      if (arg == args.end() ||
          !graph::is_pure_position(*f_.func, own_, static_cast<size_t>(arg - args.begin())))
        return false;
    }
    return true;
  }

  void check_stays_in_place() const {
    if (shares_pure_dimensions()) return;
    for (size_t d = 0; d < own_.args.size(); d++) {
      if (graph::is_pure_position(*f_.func, own_, d)) continue;
      refuse(text("it writes to ", own_.args[d], " along ", quoted(f_.func->args[d])),
             "Drop compute_with: all of the stage before runs before it");
    }
    graph::walk_definition(own_, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      const bool is_own = call && call->call_type == CallType::Func && call->name == f_.name();
      if (is_own && !graph::same_args(call->args, own_.args))
        refuse(text("it reads ", e), "Drop compute_with: all of the stage before runs before it");
    });
  }

  void check_loop(const std::string& loop) const {
    const auto own = part_along(own_.schedule, loop), before = part_along(before_.schedule, loop);
    if (!own || !before)
      refuse(text("the loop ", quoted(loop), " is fused of several"),
             "Name a loop further out, or fuse inside of the shared loops only");
    if (!is_same(*own, *before))
      refuse(text("the loop ", quoted(loop), " was split in another way in the stage before"),
             "Give both stages the same splits of what they share");
  }
};

}  // namespace

bool is_own(const Joining& joining) { return joining.func == joining.with; }

void check_own_joining(const Program& program, const Joining& joining) {
  OwnJoiningCheck(program, joining).run();
}

static bool joins_own(const LoopedFunc& f, size_t stage) {
  const LoopLevel& level = f.stages[stage].schedule.fuse_level;
  return level.kind == LoopLevel::Kind::At && level.func == f.name();
}

bool hosts_own_updates(const LoopedFunc& f, int stage) {
  const auto next = static_cast<size_t>(stage) + 1;
  return next < f.stages.size() && joins_own(f, next);
}

int last_stage_in(const LoopedFunc& f, int stage, const std::string& loop) {
  for (auto next = static_cast<size_t>(stage) + 1; next < f.stages.size() && joins_own(f, next);
       next++) {
    const std::vector<Dim>& dims = f.stages[next - 1].schedule.dims;
    const auto at = [&](const std::string& var) {
      return std::find_if(dims.begin(), dims.end(), [&](const Dim& dim) { return dim.var == var; });
    };
    if (at(loop) == dims.end() || at(loop) < at(f.stages[next].schedule.fuse_level.var)) break;
    stage = static_cast<int>(next);
  }
  return stage;
}

}  // namespace retrograde::lower
