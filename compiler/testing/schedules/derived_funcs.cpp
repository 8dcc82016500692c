#include "testing/schedules/derived_funcs.h"

#include <set>

#include "diagnostics/error.h"
#include "graph/directives/directive.h"
#include "ir/visit.h"

namespace retrograde::fuzz {

using namespace graph;

namespace {

class FuncDeriver {
 public:
  explicit FuncDeriver(Draft& draft)
      : draft_(draft), funcs_(draft.funcs), random_(draft.random), names_(draft.names) {}

  void run() {
    for (int f = 0; f < funcs_.count(); ++f) {
      if (random_.chance(8)) wrap(f);
      if (random_.chance(5)) copy_input(f);
    }
    for (int f = 0; f < funcs_.count(); ++f) {
      // Wrappers are created for consumers by name, which an update that is factored would break.
      for (int s = 1; s < funcs_.stages(f) && !wrapped_.count(funcs_.name(f)); ++s) {
        if (random_.chance(35)) factor(f, s);
      }
    }
  }

 private:
  void wrap(int f) {
    const std::vector<int> users = funcs_.direct_consumers_of(f);
    if (users.empty()) return;
    const bool clones = random_.chance(30), for_all = !clones && random_.chance(40);
    const int user = random_.pick(users);
    const std::string made = names_.fresh("w");
    std::vector<NamedFunc> named;
    if (!for_all) named.emplace_back(funcs_.name(user));
    wrapped_.insert({funcs_.name(f), funcs_.name(user)});
    draft_.add(f, clones ? Directive(Clone{made, named}) : Directive(Wrap{made, named}));
  }

  void copy_input(int f) {
    std::vector<std::string> images;
    walk(funcs_.func(f), [&](const ir::Call& call) {
      if (call.call_type == ir::CallType::Image) images.push_back(call.name);
    });
    if (images.empty() || funcs_.func(f).is_extern()) return;
    wrapped_.insert(funcs_.name(f));
    draft_.add(f, CopyInput{names_.fresh("w"), NamedFunc(random_.pick(images))});
  }

  void factor(int f, int stage) {
    if (!is_associative_update(funcs_.func(f), stage)) return;
    Loops loops = loops_of(funcs_.func(f), stage);
    std::erase_if(loops, [](const Loop& loop) { return !loop.is_reduction; });
    if (loops.empty()) return;
    std::string kept = random_.pick(loops).name;
    if (random_.chance(50)) {
      const SplitLoop split{kept, names_.fresh("rro"), names_.fresh("rri"), random_.between(2, 4)};
      draft_.add(f, split, stage);
      kept = random_.chance(50) ? split.outer : split.inner;
    }
    draft_.add(f, FactorOut{names_.fresh("p"), {{kept, names_.fresh("u")}}}, stage);
  }

  Draft& draft_;
  const ProgramFuncs& funcs_;
  Choices& random_;
  LoopNames& names_;
  std::set<std::string> wrapped_;  // wrapped Funcs and the consumers of their wrappers
};

}  // namespace

void derive_funcs(Draft& draft, const RandomProgram& program) {
  FuncDeriver(draft).run();
  try {
    draft.funcs = ProgramFuncs(program, draft.log);
  } catch (const UserError&) {
    draft.log.entries.clear();
    draft.funcs = ProgramFuncs(program, draft.log);
  }
}

}  // namespace retrograde::fuzz
