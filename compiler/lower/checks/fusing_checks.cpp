#include "lower/checks/fusing_checks.h"

#include <algorithm>
#include <set>

#include "diagnostics/error.h"
#include "graph/definitions/define.h"
#include "ir/text.h"
#include "ir/visit.h"
#include "lower/nests/own_joining.h"
#include "lower/nests/specialize.h"

namespace retrograde::lower {

namespace {

const StageLoops& schedule_of(const Program& program, int f, int stage) {
  return program.funcs[f].stages[stage].schedule;
}

bool joins(const StageLoops& schedule) { return schedule.fuse_level.kind == LoopLevel::Kind::At; }

// "g" with "f" at "y"
std::string asked_of(const Program& program, int f, int stage) {
  const LoopLevel& level = schedule_of(program, f, stage).fuse_level;
  return text("compute ", quoted(stage_name(*program.funcs[f].func, stage)), " with ",
              quoted(level.func), " down to its loop ", quoted(level.var));
}

int with_stage_of(const LoopLevel& level) { return std::max(level.stage, 0); }

// The number of loops from the outermost inwards to the one of this name; 0 if there is none.
int depth_of(const StageLoops& schedule, const std::string& var) {
  const std::vector<Dim>& dims = schedule.dims;
  for (size_t i = 0; i < dims.size(); i++) {
    if (dims[i].var == var) return static_cast<int>(dims.size() - i);
  }
  return 0;
}

const Dim& loop_at(const StageLoops& schedule, int depth) {
  return schedule.dims[schedule.dims.size() - depth];
}

std::string loops_text(const StageLoops& schedule) {
  if (schedule.dims.empty()) return "none";
  const std::vector<Dim> outermost_first(schedule.dims.rbegin(), schedule.dims.rend());
  return listed(outermost_first, [](const Dim& dim) { return quoted(dim.var); });
}

class JoiningCheck {
 public:
  JoiningCheck(const Program& program, int f, int stage)
      : program_(program),
        f_(program.funcs[f]),
        own_(schedule_of(program, f, stage)),
        level_(own_.fuse_level),
        asked_(asked_of(program, f, stage)) {}

  void run() const {
    if (level_.func.empty()) {
      user_error(text("compute ", quoted(f_.name()), " with another stage"),
                 "the loop level is set before the pipeline is compiled", "it never was",
                 "Set it: level.set(LoopLevel(f, x))");
    }
    const auto found = program_.index_of.find(level_.func);
    if (found == program_.index_of.end()) {
      user_error(asked_, "both stages belong to the pipeline and are computed somewhere",
                 quoted(level_.func) + " is inlined, or nothing reads it",
                 text("Give ", quoted(level_.func), " a compute level, or drop compute_with"));
    }
    const LoopedFunc& other = program_.funcs[found->second];
    check_is_computed_by_loops(other);
    check_is_computed_by_loops(f_);
    check_stage(other);
    check_place(other);
    const int stage = with_stage_of(level_);
    for (const StageLoops* schedule : schedules_of(other.stages[stage].schedule)) {
      if (schedule->failure.empty()) check_loops(*schedule);
    }
    check_company(f_);
    check_company(other);
  }

 private:
  const Program& program_;
  const LoopedFunc& f_;
  const StageLoops& own_;
  const LoopLevel& level_;
  const std::string asked_;

  void check_is_computed_by_loops(const LoopedFunc& f) const {
    if (f.func->is_extern()) {
      user_error(asked_, "both stages have loops",
                 quoted(f.name()) + " is computed by a C function", "Drop compute_with");
    }
    if (!f.is_output && f.is_computed_innermost()) {
      user_error(asked_, "both stages are computed at one place",
                 quoted(f.name()) + " is computed inside of each of its users",
                 text("Give ", quoted(f.name()), " a compute level: compute_root or compute_at"));
    }
  }

  void check_stage(const LoopedFunc& other) const {
    const int count = static_cast<int>(other.stages.size());
    if (level_.stage >= count || (level_.stage < 0 && count > 1)) {
      user_error(asked_, "compute_with names one stage",
                 text(quoted(other.name()), " has ", count, " stages"),
                 "Name it: compute_with(f.update(0), x), or LoopLevel(f, x, stage)");
    }
  }

  static LoopLevel place_of(const LoopedFunc& f) {
    return f.is_output ? LoopLevel{LoopLevel::Kind::Root, "", "", -1} : f.schedule.compute_level;
  }
  static std::string place_text(const LoopedFunc& f) {
    const LoopLevel level = place_of(f);
    if (level.kind == LoopLevel::Kind::Root) return quoted(f.name()) + " is computed at root";
    return text(quoted(f.name()), " is computed at ", quoted(level.var), " of ",
                quoted(level.func));
  }
  void check_place(const LoopedFunc& other) const {
    if (place_of(f_) == place_of(other)) return;
    user_error(asked_, "both stages are computed at the same place",
               place_text(f_) + ", and " + place_text(other),
               "Give both the same compute level, or drop compute_with");
  }

  void check_loops(const StageLoops& other) const {
    const int depth = depth_of(other, level_.var);
    const auto loops = [&] {
      return text("outermost first, the loops are ", loops_text(own_), " and ", loops_text(other));
    };
    if (depth == 0) {
      user_error(asked_, "the level is a loop of both stages",
                 text(quoted(level_.func), " has no loop ", quoted(level_.var), ": ", loops()),
                 "Name a loop of it");
    }
    if (static_cast<int>(own_.dims.size()) < depth) {
      user_error(asked_, "both stages have the same loops down to the level", loops(),
                 "Split and reorder both alike, or name a loop further out");
    }
    for (int d = 1; d <= depth; d++) check_loop(loop_at(own_, d), loop_at(other, d), loops());
  }

  void check_loop(const Dim& own, const Dim& other, const std::string& loops) const {
    const bool is_alike = own.is_reduction ? other.is_reduction || own.var == other.var
                                           : !other.is_reduction && own.var == other.var;
    if (!is_alike) {
      user_error(asked_, "both stages have the same loops down to the level",
                 text(loops, "; ", quoted(own.var), " would run with ", quoted(other.var)),
                 "Split and reorder both alike, or name a loop further out");
    }
    if (own.runs != other.runs) {
      user_error(asked_, "loops that run as one are of one kind",
                 text("the loop ", quoted(own.var), " is ", for_name(own.runs), ", and ",
                      quoted(other.var), " of ", quoted(level_.func), " is ", for_name(other.runs)),
                 "Give both loops the same directives");
    }
    if (own.partition != other.partition && own.partition != Partition::Auto) {
      user_error(asked_, "loops that run as one are partitioned alike",
                 text("the loop ", quoted(own.var), " was given another partition than that of ",
                      quoted(level_.func)),
                 text("Give the directive to ", quoted(level_.func)));
    }
    for (const PrefetchDirective& prefetch : own_.prefetches) {
      if (prefetch.at != own.var && prefetch.from != own.var) continue;
      user_error(asked_,
                 "what is prefetched in shared loops is prefetched by the stage whose "
                 "loops they are",
                 text("it prefetches ", quoted(prefetch.name), " at ", quoted(prefetch.at),
                      " from ", quoted(prefetch.from)),
                 text("Give the prefetch to ", quoted(level_.func)));
    }
  }

  void check_company(const LoopedFunc& f) const {
    if (!f.schedule.memoized && !f.schedule.async) return;
    unsupported(asked_, "Funcs that share loops are computed whenever any of them is needed",
                text(quoted(f.name()), " is ",
                     f.schedule.memoized ? "memoized" : "computed asynchronously"),
                text("Drop ", f.schedule.memoized ? "memoize" : "async", ", or compute_with"));
  }
};

void check_ends(const Program& program, const Joining& first,
                const std::vector<Joining>& joinings) {
  std::string path = quoted(stage_name(*program.funcs[first.func].func, first.stage));
  Joining now = first;
  for (size_t steps = 0; steps <= joinings.size(); steps++) {
    path += " with " + quoted(stage_name(*program.funcs[now.with].func, now.with_stage));
    if (now.with == first.func && now.with_stage == first.stage) {
      user_error(asked_of(program, first.func, first.stage),
                 "one of the stages that share loops is the first", path + ": a circle",
                 "Drop one compute_with of them");
    }
    const auto next = std::find_if(joinings.begin(), joinings.end(), [&](const Joining& other) {
      return other.func == now.with && other.stage == now.with_stage;
    });
    if (next == joinings.end()) return;
    now = *next;
  }
}

}  // namespace

std::vector<Joining> joinings_of(const Program& program) {
  std::vector<Joining> joinings;
  for (size_t f = 0; f < program.funcs.size(); f++) {
    for (size_t s = 0; s < program.funcs[f].stages.size(); s++) {
      const StageLoops& own = program.funcs[f].stages[s].schedule;
      if (!joins(own)) continue;
      const LoopLevel& level = own.fuse_level;
      Joining joining{static_cast<int>(f),
                      static_cast<int>(s),
                      program.index_of.at(level.func),
                      with_stage_of(level),
                      0,
                      {}};
      const StageLoops& other = schedule_of(program, joining.with, joining.with_stage);
      joining.depth = depth_of(other, level.var);
      for (int d = 1; d <= joining.depth; d++) {
        const auto asked =
            value_or(own.fuse_alignment, loop_at(own, d).var, LoopAlignStrategy::Auto);
        // Both stages have the same range, and are shifted together.
        joining.align.push_back(is_own(joining) ? LoopAlignStrategy::AlignStart : asked);
      }
      joinings.push_back(std::move(joining));
    }
  }
  return joinings;
}

void check_joinings(const Program& program) {
  for (size_t f = 0; f < program.funcs.size(); f++) {
    for (size_t s = 0; s < program.funcs[f].stages.size(); s++) {
      const int func = static_cast<int>(f), stage = static_cast<int>(s);
      if (joins(schedule_of(program, func, stage))) JoiningCheck(program, func, stage).run();
    }
  }
  const std::vector<Joining> joinings = joinings_of(program);
  for (const Joining& joining : joinings) {
    check_ends(program, joining, joinings);
    if (is_own(joining)) check_own_joining(program, joining);
  }
}

std::vector<int> callees_of(const Program& program, int f) {
  std::vector<int> callees;
  std::set<std::string> seen = {program.funcs[f].name()};
  const auto note = [&](const std::string& name) {
    const auto it = program.index_of.find(name);
    if (it != program.index_of.end() && seen.insert(name).second) callees.push_back(it->second);
  };
  for (const Definition& stage : program.funcs[f].stages) {
    walk(stage, [&](const Call& call) {
      if (call.call_type == CallType::Func) note(call.name);
    });
  }
  if (!program.funcs[f].func->is_extern()) return callees;
  for (const FuncPtr& callee : direct_callees(*program.funcs[f].func)) note(callee->name);
  return callees;
}

namespace {

// Finds a path of names, each of which reads the next, from one member of the group to another; empty if there is none.
class PathFinder {
 public:
  PathFinder(const Program& program, const FusedGroup& group)
      : program_(program), members_(group.funcs.begin(), group.funcs.end()) {}

  std::vector<int> find() {
    for (const int member : members_) {
      path_ = {member};
      if (reaches_member(member)) return path_;
    }
    return {};
  }

 private:
  const Program& program_;
  const std::set<int> members_;
  std::set<int> seen_;
  std::vector<int> path_;

  bool reaches_member(int f) {
    for (const int callee : callees_of(program_, f)) {
      path_.push_back(callee);
      if (members_.count(callee)) return true;
      // Producers come first, so no Func before the first member can depend on one.
      if (callee > *members_.begin() && seen_.insert(callee).second && reaches_member(callee))
        return true;
      path_.pop_back();
    }
    return false;
  }
};

}  // namespace

void check_group(const Program& program, const FusedGroup& group) {
  if (group.funcs.size() < 2) return;
  const std::vector<int> path = PathFinder(program, group).find();
  if (path.empty()) return;
  std::string reads = quoted(program.funcs[path[0]].name());
  for (size_t i = 1; i < path.size(); i++)
    reads += (i == 1 ? " reads " : ", which reads ") + quoted(program.funcs[path[i]].name());
  user_error(text("compute ", quoted(program.funcs[path.front()].name()), " with ",
                  quoted(program.funcs[path.back()].name())),
             "Funcs that share loops do not depend on each other", reads,
             text("Drop compute_with; compute_at puts ", quoted(program.funcs[path.back()].name()),
                  " into the loops of its consumer"));
}

void check_order_of_stages(const Program& program, const std::vector<FusedStage>& stages) {
  const FusedStage& first = stages.front();
  const std::string names = listed(stages, [&](const FusedStage& stage) {
    return quoted(stage_name(*program.funcs[stage.func].func, stage.stage));
  });
  const FusedStage& last = stages.back();
  user_error(text("compute ", quoted(stage_name(*program.funcs[last.func].func, last.stage)),
                  " with ", quoted(stage_name(*program.funcs[first.func].func, first.stage))),
             "the stages of a Func run one after another, also where others run with them",
             names + " would run together, and each stage before them earlier",
             "Compute stages together in the order of both Funcs");
}

void check_groups_have_order(const Program& program, const std::vector<FusedGroup>& groups,
                             const std::vector<int>& path, int again) {
  const auto names_of = [&](int g) {
    std::string names;
    for (const int f : groups[g].funcs)
      names += (names.empty() ? "" : " and ") + quoted(program.funcs[f].name());
    return names;
  };
  std::string needs = names_of(again);
  const auto start = std::find(path.begin(), path.end(), again);
  for (auto it = start + 1; it != path.end(); ++it) needs += ", which need " + names_of(*it);
  user_error(text("compute ", names_of(again), " together"),
             "what is computed together is computed after all that any of it reads",
             text(needs, ", which need ", names_of(again), " again"), "Drop one compute_with");
}

}  // namespace retrograde::lower
