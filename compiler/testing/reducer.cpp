// Every edit is a function that changes a copy of the program; `attempt` keeps the copy when it
// still fails. Passes run until none of them makes progress.
#include "testing/reducer.h"

#include <set>

#include "diagnostics/error.h"

namespace retrograde::fuzz {

namespace {

class Shrinker {
 public:
  Shrinker(Program program, const StillFails& still_fails, int max_trials)
      : best_(std::move(program)), still_fails_(still_fails), trials_left_(max_trials) {}

  Program run() {
    bool progress = true;
    while (progress && trials_left_ > 0) {
      progress = false;
      progress |= drop_runs();
      progress |= drop_outputs();
      progress |= drop_schedules();
      progress |= drop_updates();
      progress |= drop_values();
      progress |= drop_directives();
      progress |= simplify_terms();
      progress |= simplify_indices();
      progress |= shrink_regions();
    }
    return std::move(best_);
  }

 private:
  template <typename Edit>
  bool attempt(const Edit& edit) {
    if (trials_left_-- <= 0) return false;
    Program candidate = best_;
    edit(candidate);
    if (!still_fails_(candidate)) return false;
    best_ = std::move(candidate);
    return true;
  }

  int func_count() const { return static_cast<int>(best_.pipeline.funcs.size()); }

  // Either one of the other runs alone fails, or they are not needed.
  bool drop_runs() {
    if (best_.pipeline.sweep.empty()) return false;
    if (attempt([&](Program& p) { p.pipeline.sweep.clear(); })) return true;
    for (size_t run = 0; run < best_.pipeline.sweep.size(); ++run) {
      const bool alone = attempt([&](Program& p) {
        p.pipeline.outputs = all_runs(p.pipeline)[run + 1];
        p.pipeline.sweep.clear();
      });
      if (alone) return true;
    }
    return false;
  }

  bool drop_outputs() {
    bool progress = false;
    for (size_t i = best_.pipeline.outputs.size(); i-- > 0 && best_.pipeline.outputs.size() > 1;) {
      progress |= attempt([&](Program& p) {
        const auto at = static_cast<long>(i);
        p.pipeline.outputs.erase(p.pipeline.outputs.begin() + at);
        for (auto& regions : p.pipeline.sweep) regions.erase(regions.begin() + at);
      });
    }
    return progress;
  }

  // All that is said of a Func.
  bool drop_schedules() {
    std::set<std::string> funcs;
    for (const ScheduleLog::Entry& entry : best_.schedule.entries) funcs.insert(entry.func);
    bool progress = false;
    for (const std::string& func : funcs) {
      progress |= attempt([&](Program& p) {
        for (size_t i = p.schedule.size(); i-- > 0;) {
          if (i < p.schedule.size() && p.schedule.entries[i].func == func)
            p.schedule = p.schedule.without(i);
        }
      });
    }
    return progress;
  }

  bool drop_directives() {
    bool progress = false;
    for (size_t i = best_.schedule.size(); i-- > 0;) {
      if (i >= best_.schedule.size()) continue;  // it went with another
      if (attempt([&](Program& p) { p.schedule = p.schedule.without(i); })) {
        progress = true;
        continue;
      }
      const auto* at = std::get_if<ir::ComputeAt>(&best_.schedule.entries[i].directive);
      if (!at || at->level.kind != ir::LoopLevel::Kind::At) continue;
      progress |= attempt([&](Program& p) {
        p.schedule.entries[i].directive = ir::ComputeAt{{{ir::LoopLevel::Kind::Root, "", "", -1}}};
      });
    }
    return progress;
  }

  bool drop_updates() {
    bool progress = false;
    for (int f = 0; f < func_count(); ++f) {
      for (size_t u = best_.pipeline.funcs[f].updates.size(); u-- > 0;) {
        progress |= attempt([&](Program& p) {
          auto& updates = p.pipeline.funcs[f].updates;
          updates.erase(updates.begin() + static_cast<long>(u));
          drop_stage(p.schedule, text("f", f), static_cast<int>(u) + 1);
        });
      }
      for (size_t u = 0; u < best_.pipeline.funcs[f].updates.size(); ++u) {
        if (best_.pipeline.funcs[f].updates[u].predicate.empty()) continue;
        progress |= attempt([&](Program& p) { p.pipeline.funcs[f].updates[u].predicate.clear(); });
      }
    }
    return progress;
  }

  static void drop_stage(ScheduleLog& log, const std::string& func, int stage) {
    for (size_t i = log.size(); i-- > 0;) {
      if (i < log.size() && log.entries[i].func == func && log.entries[i].stage == stage)
        log = log.without(i);
    }
    for (ScheduleLog::Entry& entry : log.entries) {
      if (entry.func == func && entry.stage > stage) --entry.stage;
    }
  }

  // The last value of a Tuple; reads of it turn to the first value when that has its type.
  bool drop_values() {
    bool progress = false;
    for (int f = 0; f < func_count(); ++f) {
      const auto& values = best_.pipeline.funcs[f].values;
      if (values.size() < 2 || values[0].type != values.back().type) continue;
      progress |= attempt([&](Program& p) {
        FuncSpec& func = p.pipeline.funcs[f];
        func.values.pop_back();
        for (UpdateSpec& update : func.updates) update.values.pop_back();
        for_each_term_of_program(p, [&](int g, Term& term) {
          const bool reads = (term.action == Action::Func && term.source == f) ||
                             (term.action == Action::Self && g == f);
          if (reads) term.element = 0;
        });
      });
    }
    return progress;
  }

  template <typename F>
  static void for_each_term_of_program(Program& program, const F& f) {
    for (size_t g = 0; g < program.pipeline.funcs.size(); ++g) {
      FuncSpec& func = program.pipeline.funcs[g];
      for (size_t s = 0; s <= func.updates.size(); ++s) {
        for_each_term_of_stage(func, static_cast<int>(s),
                               [&](Term& term) { f(static_cast<int>(g), term); });
      }
    }
  }

  // Term number `at` of the program in walking order, or null.
  static Term* term_at(Program& program, int at) {
    Term* found = nullptr;
    int count = 0;
    for_each_term_of_program(program, [&](int, Term& term) {
      if (count++ == at) found = &term;
    });
    return found;
  }

  bool simplify_terms() {
    bool progress = false;
    for (int at = 0; trials_left_ > 0; ++at) {
      const Term* term = term_at(best_, at);
      if (!term) break;
      if (term->action == Action::Constant) continue;
      const Type type = term->type;
      bool replaced = attempt([&](Program& p) {
        Term constant;
        constant.type = type;
        constant.value = 1;
        *term_at(p, at) = constant;
      });
      for (size_t i = 0; !replaced && i < term->operands.size(); ++i) {
        if (term->operands[i].type != type) continue;
        replaced = attempt([&](Program& p) {
          Term* target = term_at(p, at);
          Term operand = target->operands[i];
          *target = std::move(operand);
        });
      }
      progress |= replaced;
    }
    return progress;
  }

  bool simplify_indices() {
    bool progress = false;
    for (int at = 0; trials_left_ > 0; ++at) {
      const Term* term = term_at(best_, at);
      if (!term) break;
      if (term->action == Action::Self) continue;  // follows the left side
      for (size_t i = 0; i < term_at(best_, at)->indices.size(); ++i) {
        const Index& index = term_at(best_, at)->indices[i];
        const bool plain = index.offset == 0 && index.scale == 1 && index.divisor == 1;
        if (plain && index.data.empty()) continue;
        progress |= attempt([&](Program& p) {
          Index& simpler = term_at(p, at)->indices[i];
          simpler.offset = 0;
          simpler.scale = simpler.divisor = 1;
          simpler.data.clear();
        });
      }
    }
    return progress;
  }

  bool shrink_regions() {
    bool progress = false;
    for (size_t o = 0; o < best_.pipeline.outputs.size(); ++o) {
      for (size_t d = 0; d < best_.pipeline.outputs[o].extents.size(); ++d) {
        const int extent = best_.pipeline.outputs[o].extents[d];
        for (const int smaller : {1, extent / 2, extent - 1}) {
          if (smaller < 1 || smaller >= extent) continue;
          if (attempt([&](Program& p) { p.pipeline.outputs[o].extents[d] = smaller; })) {
            progress = true;
            break;
          }
        }
        if (best_.pipeline.outputs[o].mins[d] != 0) {
          progress |= attempt([&](Program& p) { p.pipeline.outputs[o].mins[d] = 0; });
        }
      }
    }
    return progress | shrink_domains();
  }

  bool shrink_domains() {
    bool progress = false;
    for (int f = 0; f < func_count(); ++f) {
      for (size_t u = 0; u < best_.pipeline.funcs[f].updates.size(); ++u) {
        for (size_t k = 0; k < best_.pipeline.funcs[f].updates[u].domain.size(); ++k) {
          if (best_.pipeline.funcs[f].updates[u].domain[k].extent <= 1) continue;
          progress |=
              attempt([&](Program& p) { --p.pipeline.funcs[f].updates[u].domain[k].extent; });
        }
      }
    }
    return progress;
  }

  Program best_;
  const StillFails& still_fails_;
  int trials_left_;
};

}  // namespace

Program shrink(Program program, const StillFails& still_fails, int max_trials) {
  return Shrinker(std::move(program), still_fails, max_trials).run();
}

}  // namespace retrograde::fuzz
