#include "lower/checks/schedule_checks.h"

#include "ir/build.h"
#include "lower/checks/run_time_check.h"
#include "retrograde_runtime.h"

namespace retrograde::lower {
namespace {

class SizeChecks {
 public:
  void add(const LoopedFunc& f) {
    for (const Definition& stage : f.stages) add_factors(f, stage.schedule, const_true());
    for (const StorageRule& rule : f.schedule.storage_rules)
      check(rule.alignment, const_true(),
            text("align the storage of ", quoted(f.name()), " in ", quoted(rule.var)),
            "the alignment");
    check(f.schedule.ring, const_true(), text("keep a ring buffer of ", quoted(f.name())),
          "the number of copies");
    for (const Bound& bound : f.schedule.bounds)
      check(bound.modulus, const_true(),
            text("align the bounds of ", quoted(bound.var), " of ", quoted(f.name())),
            "the modulus");
  }

  std::vector<Stmt> checks;

 private:
  // A schedule's factors are checked only where it runs: its condition holds, and none before it.
  void add_factors(const LoopedFunc& f, const StageLoops& schedule, Expr runs) {
    for (const StageLoops& special : schedule.specializations) {
      if (!special.condition.defined()) continue;
      add_factors(f, special, runs && special.condition);
      runs = runs && !special.condition;
    }
    for (const Split& split : schedule.splits) {
      if (split.kind != Split::Kind::Split) continue;
      check(split.factor, runs, text("split ", quoted(split.old_var), " of ", quoted(f.name())),
            "a factor");
    }
  }

  void check(const Expr& size, const Expr& runs, const std::string& asked, const char* what) {
    if (!size.defined() || is_const(size)) return;
    const std::string broken = text("cannot ", asked, ": ", what, " is at least 1; it is ");
    checks.push_back(run_time_check(!runs || size >= 1, retrograde_error_requirement_failed, broken,
                                    size, ". Pass a positive value."));
  }
};

}  // namespace

std::vector<Stmt> schedule_checks(const Program& program) {
  SizeChecks all;
  for (const LoopedFunc& f : program.funcs) all.add(f);
  return std::move(all.checks);
}

}  // namespace retrograde::lower
