#include "transform/coarse_values.h"

#include <algorithm>
#include <map>
#include <optional>

#include "diagnostics/error.h"
#include "graph/definitions/define.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/directive.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/lets.h"
#include "transform/coarse_axis.h"
#include "transform/separable_sums.h"
#include "transform/size_estimate.h"

namespace retrograde::transform {

namespace {

constexpr size_t most_nodes = 4096;
constexpr double least_saved = 1 << 12;  // terms: less is no time
constexpr double least_gain = 1.5;       // terms before for each after

bool mentions_reduction(const Expr& e) {
  return any_node(e, [](const Variable& v) { return domain_of(v) != nullptr; });
}

bool has_effects(const Expr& e) {
  return any_node(e, [](const Call& call) {
    if (call.is_extern()) return !call.is_pure_extern();
    return call.call_type == CallType::Operator &&
           (op_info(call.op).cls == OpClass::Effect || op_info(call.op).cls == OpClass::Internal ||
            op_info(call.op).conduct != Conduct::Silent);
  });
}

// A Func with its stages while they are rewritten, and the ranges of its pure variables.
struct Subject {
  const FuncContents& f;
  std::vector<Definition> stages;
  VariableRanges ranges;

  // The number of iterations of some of the variables.
  double points(const std::vector<std::string>& variables) const {
    double result = 1;
    for (const std::string& name : variables) result *= extent_of(ranges.at(name)).value_or(0);
    return result;
  }
};

VariableRanges with_reductions(VariableRanges ranges, const Definition& stage) {
  for (const ReductionVariable& r : stage.rvars)
    ranges[r.var] = constant_ends({r.min, r.min + r.extent - 1});
  return ranges;
}

std::vector<std::string> used_of(const std::vector<std::string>& names, const Expr& e) {
  return filtered(names, [&](const std::string& name) { return uses_variable(e, name); });
}

// The greatest parts of an expression that depend on the variable of the axis through an index of a grid.
class CoarseParts {
 public:
  CoarseParts(const Subject& subject, CoarseAxis& axis) : subject_(subject), axis_(axis) {}

  std::vector<Expr> in(const std::vector<Expr>& values) {
    for (const Expr& value : values) visit(value);
    return std::move(found_);
  }

 private:
  // Reads of the grid that is read most often.
  size_t reads_in(const Expr& e) {
    std::map<const Symbol*, size_t> reads;
    size_t most = 0;
    walk(e, [&](const Expr& node) {
      if (!is_element_read(node) || !axis_.of(node).is_through_index()) return true;
      most = std::max(most, ++reads[node.as<Call>()->symbol.raw()]);
      return false;
    });
    return most;
  }

  bool is_worth_storing(const Expr& e) {
    if (!e.type().is_float() || is_element_read(e) || !axis_.of(e).is_through_index()) return false;
    if (used_of(subject_.f.args, e).size() < 2) return false;
    const size_t reads = reads_in(e);
    return reads >= 2 &&
           subject_.points(subject_.f.args) * static_cast<double>(reads) >= least_saved &&
           !mentions_reduction(e) && !has_effects(e);
  }

  void visit(const Expr& e) {
    if (is_const(e) || !seen_.insert(e.get()).second) return;
    if (is_worth_storing(e)) {
      found_.push_back(e);
      return;
    }
    if (is_element_read(e) || as_op(e, Op::if_then_else, Op::strict_float)) return;
    for_each_child(e, [&](const Expr& child) { visit(child); });
  }

  const Subject& subject_;
  CoarseAxis& axis_;
  std::unordered_set<const ExprNode*> seen_;
  std::vector<Expr> found_;
};

class CoarseHoister {
 public:
  CoarseHoister(const std::vector<FuncPtr>& outputs, RangeOfVariable range, SumOrder order)
      : graph_(outputs), range_(range), order_(order) {
    for (const FuncPtr& f : graph_.order()) {
      if (f->made && f->made->role == Role::SharedValue) known_.push_back(f);
    }
  }

  FactoredGraph run() {
    for (const FuncPtr& f : graph_.order()) {
      Subject subject{*f, stages_of(*f), {}};
      const bool is_changed = is_candidate(*f) && hoist_from_candidate(subject);
      if (is_changed || graph_.reads_copies(*f)) graph_.copy(f, subject.stages);
    }
    return graph_.finish();
  }

 private:
  // Whether some stage reads an element at an index that divides or rounds; no analysis of the graph for the others.
  static bool is_candidate(const FuncContents& f) {
    if (!is_users(f) || f.args.size() < 2) return false;
    size_t nodes = 0;
    bool has_coarse = false;
    walk(f, [&](const Expr& e) {
      has_coarse |= e.type().is_int() &&
                    (e.kind() == Kind::Div || e.kind() == Kind::Cast || as_op(e, Op::shift_right));
      return ++nodes <= most_nodes;
    });
    return has_coarse && nodes <= most_nodes;
  }

  bool hoist_from_candidate(Subject& subject) {
    for (const std::string& arg : subject.f.args) {
      Interval all;
      for (int s = 0; s < subject.f.stage_count(); ++s) {
        const Interval range = constant_ends(range_(subject.f, s, arg));
        all = s == 0 ? range : constant_ends(analysis::hull(all, range));
      }
      if (!extent_of(all)) return false;
      subject.ranges[arg] = all;
    }
    for (Definition& stage : subject.stages)
      stage = map_exprs(stage, [](const Expr& e) { return without_lets(e); });
    return hoist(subject);
  }

  // The outermost variable first: elements of the Func along inner ones lie together, and vectors run along them.
  bool hoist(Subject& subject) {
    bool is_changed = false;
    for (size_t d = subject.f.args.size(); d-- > 0;) {
      for (size_t s = 0; s < subject.stages.size(); ++s) {
        if (subject.stages[s].predicate.defined()) continue;
        is_changed |= hoist_along(subject, s, subject.f.args[d]);
      }
    }
    return is_changed;
  }

  bool hoist_along(Subject& subject, size_t s, const std::string& variable) {
    Definition& stage = subject.stages[s];
    const VariableRanges ranges = with_reductions(subject.ranges, stage);
    CoarseAxis axis(variable, subject.f.args, ranges);
    if (order_ == SumOrder::Free && !stage.rvars.empty() && split_sum(subject, stage, axis))
      return true;
    std::vector<Expr> values = stage.values;
    if (order_ == SumOrder::Free && s == 0)
      values = mapped(values, [&](const Expr& e) { return with_grouped_terms(e, axis); });
    const std::vector<Expr> parts = CoarseParts(subject, axis).in(values);
    FactorReads reads;
    for (const Expr& part : parts) reads[part.get()] = read_of(subject, part, axis);
    if (parts.empty()) return false;
    stage.values = mapped(values, [&](const Expr& e) { return graph_.redirected(e, reads); });
    return true;
  }

  // A call of the Func for a part.
  Expr read_of(const Subject& subject, const Expr& part, CoarseAxis& axis) {
    const Expr index = axis.of(part).index;
    const Expr value = graph_.redirected(axis.over_grid(part, index));
    const std::vector<std::string> args = used_of(subject.f.args, value);
    const auto known = std::ranges::find_if(known_, [&](const FuncPtr& g) {
      return g->is_pure() && g->args == args && g->pure->values.size() == 1 &&
             equal(g->pure->values[0], value);
    });
    FuncPtr g = known == known_.end() ? nullptr : *known;
    if (!g) {
      g = make_func(Role::SharedValue, subject.f.name + "_rows", subject.f.name);
      define_pure(g, variables_of(args), {value});
      known_.push_back(g);
      finish(g, subject, axis, index);
    }
    return call_of(g, axis, index);
  }

  static Expr call_of(const FuncPtr& g, const CoarseAxis& axis, const Expr& index) {
    std::vector<Expr> at = variables_of(g->args);
    for (Expr& e : at) {
      if (e.as<Variable>()->name == axis.variable()) e = index;
    }
    return call_func(g->name, g->types[0], at, 0, SymbolRef(g));
  }

  // Hoists from the new Func, too: a grid of three dimensions is interpolated along each in turn.
  void finish(const FuncPtr& g, const Subject& subject, const CoarseAxis& axis, const Expr& index) {
    Subject own{*g, stages_of(*g), {}};
    for (const std::string& arg : g->args) own.ranges[arg] = subject.ranges.at(arg);
    own.ranges[axis.variable()] = axis.range_of(index);
    if (hoist(own)) {
      for (size_t s = 0; s < own.stages.size(); ++s) g->stage(static_cast<int>(s)) = own.stages[s];
    }
    graph_.add_factor(
        g, text(quoted(g->name), " keeps what ", quoted(subject.f.name),
                " reads of a coarse grid, for each of its coordinates along ", axis.variable()));
  }

  static double terms_of(const std::vector<ReductionVariable>& loops) {
    double result = 1;
    for (const ReductionVariable& r : loops)
      result *= extent_of(constant_ends({r.min, r.min + r.extent - 1})).value_or(0);
    return result;
  }

  // f(x, y) += w(y, r.y) rows(x, y / n + r.y) in place of a sum over r.x and r.y.
  bool split_sum(const Subject& subject, Definition& stage, CoarseAxis& axis) {
    const FuncContents& f = subject.f;
    const auto* sum = stage.values[0].as<Binary>();
    if (stage.values.size() != 1 || !is_plain_sum(f, stage)) return false;
    const auto split = split_product(sum->b, stage.rvars, axis);
    if (!split || has_effects(sum->b)) return false;
    const std::vector<std::string> args = used_of(f.args, split->inner_factor);
    VariableRanges of_rows = subject.ranges;
    of_rows[axis.variable()] = axis.range_of(split->index);
    const double before = subject.points(f.args) * terms_of(stage.rvars);
    const double after = Subject{f, {}, of_rows}.points(args) * terms_of(split->inner) +
                         subject.points(f.args) * terms_of(split->outer);
    if (args.size() < 2 || before < least_gain * after || before - after < least_saved)
      return false;
    const FuncPtr g = rows_of(f, *split, args);
    finish(g, subject, axis, split->index);
    const DomainPtr domain = make_domain();
    const Substitution loops = add_loops(domain, split->outer);
    Definition outer = stage;
    const Expr product = split->outer_factor * call_of(g, axis, split->index);
    outer.values = {binary(stage.values[0].kind(), sum->a, substitute(product, loops))};
    outer.rvars = domain->vars;
    outer.schedule.dims = first_loops(f, outer);
    stage = outer;
    return true;
  }

  // f(x, ...) = f(x, ...) + product of floats over constant loops.
  static bool is_plain_sum(const FuncContents& f, const Definition& update) {
    const Expr& value = update.values[0];
    const auto* sum = value.as<Binary>();
    if (!sum || !value.type().is_float() ||
        (value.kind() != Kind::Add && value.kind() != Kind::Sub) || point_number(update))
      return false;
    for (size_t d = 0; d < f.args.size(); ++d) {
      if (!is_pure_position(f, update, d)) return false;
    }
    return is_old_value(sum->a, f, update) && terms_of(update.rvars) > 0 &&
           !any_node(sum->b, [&](const Expr& e) { return as_call_of(e, &f) != nullptr; });
  }

  static Substitution add_loops(const DomainPtr& domain,
                                const std::vector<ReductionVariable>& loops) {
    Substitution result;
    for (const ReductionVariable& r : loops)
      result[r.var] = add_loop(domain, without_numbers(r.var), r.min, r.extent);
    return result;
  }

  FuncPtr rows_of(const FuncContents& f, const SplitProduct& split,
                  const std::vector<std::string>& args) const {
    const FuncPtr g = make_func(Role::SharedValue, f.name + "_rows", f.name);
    const Type type = split.inner_factor.type();
    define_pure(g, variables_of(args), {make_zero(type)});
    const DomainPtr domain = make_domain();
    const Substitution loops = add_loops(domain, split.inner);
    const Expr term = substitute(graph_.redirected(split.inner_factor), loops);
    const Expr old = call_func(g->name, type, variables_of(args), 0, SymbolRef(g));
    define_update(g, variables_of(args), {old + term}, domain);
    return g;
  }

  GraphFactoring graph_;
  const RangeOfVariable range_;
  const SumOrder order_;
  std::vector<FuncPtr> known_;  // shared values of this graph and new ones
};

}  // namespace

FactoredGraph hoist_coarse_values(const std::vector<FuncPtr>& outputs, RangeOfVariable range,
                                  SumOrder order) {
  return CoarseHoister(outputs, range, order).run();
}

}  // namespace retrograde::transform
