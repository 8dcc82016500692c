#include "autoschedule/choices.h"

#include <algorithm>
#include <set>

#include "autoschedule/cost_estimate.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/new_loop.h"
#include "frontend/language/func.h"
#include "frontend/schedule/loop_level.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t most_copies = 16;
constexpr double most_operations = 4000;  // of all copies: code is compiled, and fits in a cache

// Whether constants decide it once the values of these variables are known.
bool is_decided_by(const Expr& condition, const std::set<std::string>& known) {
  return !any_node(condition, [&](const Expr& node) {
    const auto* variable = node.as<Variable>();
    const auto* call = node.as<Call>();
    return (call && call->call_type != CallType::Operator) ||
           (variable && !known.contains(variable->name));
  });
}

// Vectors along rows, the first dimension, are all that was cut off.
bool runs_along_rows(const FuncContents& f) {
  const StageLoops& loops = f.pure->schedule;
  return f.is_pure() && !f.is_extern() && f.args.size() > 1 && loops.splits.size() == 1 &&
         loops.splits[0].old_var == f.args[0] && loops.splits[0].outer == f.args[0];
}

bool has_bound(const FuncContents& f, const std::string& var) {
  const auto& bounds = f.schedule.bounds;
  return std::any_of(bounds.begin(), bounds.end(),
                     [&](const Bound& bound) { return bound.var == var; });
}

// The copies innermost, but for the vectors; the tasks are loops that are left.
void unroll(const FuncPtr& f, const std::vector<size_t>& chosen, const FixedDimensions& fixed,
            const SizeEstimate& sizes) {
  run_serially(f);
  Stage stage(f, 0);
  std::vector<VarOrRVar> copies, others;
  for (const size_t d : chosen) {
    const FixedRange range = *fixed.of(*f, d);
    const Var choice(f->args[d]);
    if (!has_bound(*f, f->args[d]))
      Func(f).bound(choice, static_cast<int>(range.min), static_cast<int>(range.extent));
    copies.push_back(choice);
  }
  const std::vector<Dim> loops = f->pure->schedule.dims;
  for (const Dim& loop : loops) {
    const auto is_it = [&](const VarOrRVar& copy) { return copy.name() == loop.var; };
    if (std::none_of(copies.begin(), copies.end(), is_it)) others.push_back(Var(loop.var));
  }
  std::vector<VarOrRVar> order{others[0]};
  order.insert(order.end(), copies.begin(), copies.end());
  order.insert(order.end(), others.begin() + 1, others.end());
  stage.reorder(order);
  for (const VarOrRVar& copy : copies) stage.unroll(copy);
  int64_t tasks = 1;
  const int64_t enough = sizes.machine().enough_tasks();
  for (size_t i = others.size(); i-- > 1 && tasks < enough;) {
    const auto arg = std::find(f->args.begin() + 1, f->args.end(), others[i].name());
    if (arg == f->args.end()) break;  // that of the vectors
    stage.parallel(others[i]);
    tasks *= sizes.extent(*f, static_cast<size_t>(arg - f->args.begin())).value_or(enough);
  }
}

// Whether the arguments are the variables of the reader's loops, the one of its vectors first, each
// once, but for those of its copies.
bool reads_own_element(const Call& read, const FuncContents& reader) {
  std::set<std::string> free;
  for (const Dim& loop : reader.pure->schedule.dims) {
    const bool is_element =
        std::find(reader.args.begin(), reader.args.end(), loop.var) != reader.args.end();
    if (is_element && loop.runs != ForType::Unrolled) free.insert(loop.var);
  }
  const auto* first = read.args[0].as<Variable>();
  if (!first || first->name != reader.args[0]) return false;
  const bool are_variables = std::all_of(read.args.begin(), read.args.end(), [&](const Expr& arg) {
    const auto* variable = arg.as<Variable>();
    return variable && free.erase(variable->name) > 0;
  });
  return are_variables && free.empty();
}

}  // namespace

std::vector<size_t> chosen_dimensions(const FuncContents& f, const FixedDimensions& fixed,
                                      ChoicesOf whose) {
  std::vector<size_t> chosen;
  std::set<std::string> few;
  for (size_t d = 1; d < f.args.size(); ++d) {
    const auto range = fixed.of(f, d);
    if (range && range->extent > 1 && range->extent <= most_copies) few.insert(f.args[d]);
  }
  if (!f.is_pure() || f.is_extern() || few.empty()) return chosen;
  std::set<std::string> used;
  std::vector<Expr> roots = f.pure->values;
  if (whose == ChoicesOf::WithInlined) roots = roots_with_inlined(*f.pure);
  for (const Expr& root : roots) {
    any_node(root, [&](const Select& choice) {
      if (!is_decided_by(choice.condition, few)) return false;
      for (const std::string& var : few) {
        if (uses_variable(choice.condition, var)) used.insert(var);
      }
      return false;
    });
  }
  int64_t copies = 1;
  for (size_t d = 1; d < f.args.size(); ++d) {
    if (!used.contains(f.args[d]) || copies * fixed.of(f, d)->extent > most_copies) continue;
    copies *= fixed.of(f, d)->extent;
    chosen.push_back(d);
  }
  const double operations = operations_of_values(roots, [](const Call&) { return 1.0; });
  return operations * static_cast<double>(copies) <= most_operations ? chosen
                                                                     : std::vector<size_t>();
}

void unroll_choices(const std::vector<FuncPtr>& given, const FixedDimensions& fixed,
                    const SizeEstimate& sizes) {
  for (const FuncPtr& f : given) {
    if (!runs_along_rows(*f) || !is_at_root(*f)) continue;
    const std::vector<size_t> chosen = chosen_dimensions(*f, fixed, ChoicesOf::WithInlined);
    if (!chosen.empty()) unroll(f, chosen, fixed, sizes);
  }
}

void compute_beside_choices(const Readers& readers, const std::vector<FuncPtr>& given,
                            const std::unordered_set<const Symbol*>& but) {
  for (const FuncPtr& f : given) {
    if (!runs_along_rows(*f) || !is_at_root(*f) || !readers.is_inside(f) || readers.is_output(f) ||
        but.contains(f.get()))
      continue;
    const auto reader = readers.only_reader(f);
    if (!reader || !runs_along_rows(*reader->func) || but.contains(reader->func.get())) continue;
    // Both have vectors of the same elements.
    if (!equal(f->pure->schedule.splits[0].factor, reader->func->pure->schedule.splits[0].factor))
      continue;
    const auto& loops = reader->func->pure->schedule.dims;
    const bool has_copies = std::any_of(
        loops.begin(), loops.end(), [](const Dim& loop) { return loop.runs == ForType::Unrolled; });
    const bool is_same =
        std::all_of(reader->reads.begin(), reader->reads.end(), [&](const Call* read) {
          return reads_own_element(*read, *reader->func) &&
                 graph::same_args(read->args, reader->reads[0]->args);
        });
    if (!has_copies || !is_same) continue;
    run_serially(f);
    Func(f).compute_at(Func(reader->func), Var(reader->func->args[0]));
  }
}

}  // namespace retrograde::autoschedule
