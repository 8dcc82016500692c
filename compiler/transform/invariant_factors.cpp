#include "transform/invariant_factors.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "autoschedule/machine/reference.h"
#include "graph/definitions/define.h"
#include "graph/definitions/own_reads.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/lets.h"
#include "simplify/simplify.h"
#include "transform/coarse_values.h"
#include "transform/cost_estimate.h"
#include "transform/size_estimate.h"

namespace retrograde::transform {

namespace {

constexpr size_t most_term_nodes = 4096;
constexpr size_t most_loops = 64;  // which are the bits of a mask
constexpr int64_t short_row = 64, two_vectors = 2 * planning::schedule_lanes;  // elements

using LoopSet = uint64_t;

bool reads_element(const Expr& e) {
  const auto* call = e.as<Call>();
  return call && (call->call_type == CallType::Func || call->call_type == CallType::Image);
}
bool is_addition(const Expr& e) { return e.kind() == Kind::Add || e.kind() == Kind::Sub; }
// A quotient by something that has an adjoint: each of its two operands gets a sum of as many terms, with divisions.
bool is_quotient(const Expr& e) {
  const auto* quotient = e.as<Binary>();
  return quotient && e.kind() == Kind::Div &&
         any_node(quotient->b, [](const Expr& part) { return reads_element(part); });
}
bool is_product(const Expr& e) {
  const auto* cast = e.as<Cast>();
  return cast ? is_product(cast->value) : e.kind() == Kind::Mul;
}

// The term that an update adds to its element; undefined: it is no such update.
Expr term_of(const FuncContents& f, const Definition& update, size_t k) {
  const auto* sum = update.values[k].as<Binary>();
  if (!sum || !is_addition(update.values[k]) ||
      !is_old_value(sum->a, f, update, static_cast<int>(k)))
    return {};
  return any_node(sum->b, [&](const Expr& e) { return as_call_of(e, &f) != nullptr; }) ? Expr()
                                                                                       : sum->b;
}

bool has_candidates(const FuncContents& f, const Definition& update) {
  const bool is_plain = !update.rvars.empty() && !update.predicate.defined() &&
                        !point_number(update) && update.rvars.size() + f.args.size() <= most_loops;
  if (!is_plain) return false;
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (!is_pure_position(f, update, d)) return false;
  }
  for (size_t k = 0; k < update.values.size(); ++k) {
    const Expr term = term_of(f, update, k);
    if (!term.defined()) return false;
    size_t nodes = 0;
    walk(term, [&](const Expr&) { return ++nodes <= most_term_nodes; });
    if (nodes > most_term_nodes) return false;
  }
  return operations_of_values(update.values, [](const Call&) { return 1.0; }) > cheap;
}

// How many values a variable of one stage takes.
using ValuesInStage = FunctionRef<std::optional<int64_t>(const std::string& variable)>;

// The costly factors of one update.
class Factors {
 public:
  // `update`: of f, without lets. `values`: of its variables.
  Factors(const FuncContents& f, const Definition& update, ValuesInStage values)
      : f_(f), update_(update) {
    for (const std::string& arg : f.args) add_loop(arg, values(arg));
    for (const ReductionVariable& r : update_.rvars) {
      reductions_ |= LoopSet{1} << names_.size();
      add_loop(r.var, values(r.var));
    }
  }

  std::vector<Expr> find() {
    for (size_t k = 0; k < update_.values.size(); ++k) visit(term_of(f_, update_, k), true);
    return std::move(found_);
  }

 private:
  static constexpr double many_terms = 256;  // for each element of a quotient
  static constexpr double clear_gain = 2;    // of the way to memory, for each element
  static constexpr double least_saved =
      planning::launch_operations / 8;        // operations: less is no time
  static constexpr double sums_in_tile = 16;  // they share what is not a function
  static constexpr double most_bytes = 4 * planning::third_cache_bytes;  // of all factors of a Func

  void add_loop(const std::string& name, std::optional<int64_t> extent) {
    bits_[name] = LoopSet{1} << names_.size();
    names_.push_back(name);
    extents_.push_back(extent);
  }

  // The variables of the stage that an expression depends on.
  LoopSet loops_of(const Expr& e) {
    if (const auto known = loops_.find(e.get()); known != loops_.end()) return known->second;
    LoopSet loops = 0;
    const auto* v = e.as<Variable>();
    if (v && (!v->symbol.defined() || domain_of(*v))) {
      const auto found = bits_.find(v->name);
      if (found != bits_.end()) loops = found->second;
    }
    for_each_child(e, [&](const Expr& child) { loops |= loops_of(child); });
    return loops_[e.get()] = loops;
  }

  // Operations of the nodes that need all of the variables, for each term. What needs fewer is a factor of its own, if
  // it is costly.
  double operations_over(const Expr& factor, LoopSet loops) {
    double functions = 0, others = 0;
    std::unordered_set<const ExprNode*> seen;
    walk(factor, [&](const Expr& e) {
      if (!seen.insert(e.get()).second || loops_of(e) != loops) return false;
      const bool is_costly = work_of(e).function_adds > 0 || e.kind() == Kind::Div;
      (is_costly ? functions : others) += operations_of(e);
      return !reads_element(e);
    });
    return functions + others / sums_in_tile;
  }

  // The product of the extents; nullopt: one is not known.
  std::optional<double> iterations(LoopSet loops) const {
    double result = 1;
    for (size_t i = 0; i < names_.size(); ++i) {
      if (!(loops >> i & 1)) continue;
      if (!extents_[i]) return std::nullopt;
      result *= static_cast<double>(std::max<int64_t>(*extents_[i], 0));
    }
    return result;
  }
  // Iterations of the stage for each element of a factor. An extent that is not known counts as 1.
  double repeats(LoopSet loops) const {
    double result = 1;
    for (size_t i = 0; i < names_.size(); ++i) {
      if (!(loops >> i & 1)) result *= static_cast<double>(extents_[i].value_or(1));
    }
    return result;
  }

  bool can_move(const Expr& factor) const {
    return !any_node(factor, [](const Expr& e) {
      const auto* call = e.as<Call>();
      if (!call) return e.kind() == Kind::Let;
      if (call->is_extern()) return !call->is_pure_extern();
      return call->call_type == CallType::Operator &&
             (op_info(call->op).cls == OpClass::Effect ||
              op_info(call->op).cls == OpClass::Internal ||
              op_info(call->op).conduct != Conduct::Silent);
    });
  }

  bool is_worth_storing(const Expr& e, LoopSet loops) {
    const LoopSet all =
        names_.size() == most_loops ? ~LoopSet{0} : (LoopSet{1} << names_.size()) - 1;
    if (!e.type().is_float() || reads_element(e) || loops == all) return false;
    const double again = repeats(loops) - 1, operations = operations_over(e, loops);
    const bool leaves_its_loops = (loops & reductions_) == 0;
    if (leaves_its_loops && !(is_quotient(e) && again >= many_terms)) return false;
    if (operations <= (is_quotient(e) ? 0 : cheap) ||
        again * operations < clear_gain * planning::memory_trip_operations)
      return false;
    const auto elements = iterations(loops);
    if (!elements || *elements * again * operations < least_saved) return false;
    const double bytes = *elements * e.type().bytes();
    if (bytes_ + bytes > most_bytes || !can_move(e)) return false;
    bytes_ += bytes;
    return true;
  }

  // `is_added`: e is a term of a sum.
  void visit(const Expr& e, bool is_added) {
    if (is_const(e) || !seen_.insert(e.get()).second) return;
    if (!(is_added && is_product(e)) && is_worth_storing(e, loops_of(e))) {
      found_.push_back(e);
      return;
    }
    if (reads_element(e) || as_op(e, Op::if_then_else, Op::strict_float)) return;
    const bool adds_children = is_addition(e) || (is_added && e.kind() == Kind::Cast);
    for_each_child(e, [&](const Expr& child) { visit(child, adds_children); });
  }

  const FuncContents& f_;
  const Definition& update_;
  std::vector<std::string> names_;  // pure variables, then reduction variables
  std::vector<std::optional<int64_t>> extents_;
  std::unordered_map<std::string, LoopSet> bits_;
  LoopSet reductions_ = 0;
  double bytes_ = 0;
  std::unordered_map<const ExprNode*, LoopSet> loops_;
  std::unordered_set<const ExprNode*> seen_;
  std::vector<Expr> found_;
};

// A factor as the definition of a Func. Its dimensions are the variables that it depends on, in the order of the stage.
//
// Pure variables usually come first. If vectors of the sum run along one of them, they load the factor. Otherwise the
// sum takes single elements of it, and its adjoint is a sum along rows of the Func, by vectors of terms. Where these rows
// are short, reduction variables come first if vectors of the adjoint can run along them instead.
struct FactorDefinition {
  std::vector<std::string> args;
  Expr value;
  std::vector<Expr> at;  // where the term reads it

  bool is_of(const FuncContents& g) const {
    return g.is_pure() && g.args == args && g.pure->values.size() == 1 &&
           equal(g.pure->values[0], value);
  }
};

// The variable as the user named it: x for r$3.x.
std::string plain_name(const std::string& variable) {
  const std::string name = without_numbers(variable);
  const size_t dot = name.rfind('.');
  return dot == std::string::npos ? name : name.substr(dot + 1);
}

FactorDefinition definition_of(const FuncContents& f, const Definition& update, const Expr& factor,
                               ValuesInStage values) {
  std::unordered_map<std::string, Expr> used;
  walk(factor, [&](const Expr& e) {
    if (const auto* v = e.as<Variable>()) used.emplace(v->name, e);
    return true;
  });
  FactorDefinition result;
  Substitution names;
  const auto add = [&](const std::string& variable) {
    const auto found = used.find(variable);
    if (found == used.end()) return;
    std::string name = plain_name(variable);
    if (std::ranges::find(result.args, name) != result.args.end())
      name += text("_", result.args.size());
    result.args.push_back(name);
    names[variable] = ir::variable(name);
    result.at.push_back(found->second);
  };
  const auto add_pure = [&] { std::ranges::for_each(f.args, add); };
  const auto first = std::ranges::find_if(
      update.rvars, [&](const ReductionVariable& r) { return used.contains(r.var); });
  const bool has_short_rows = !f.args.empty() && !used.contains(f.args[0]) &&
                              values(f.args[0]).value_or(short_row + 1) <= short_row &&
                              first != update.rvars.end() &&
                              values(first->var).value_or(0) >= two_vectors;
  if (!has_short_rows) add_pure();
  for (const ReductionVariable& r : update.rvars) add(r.var);
  if (has_short_rows) add_pure();
  result.value = substitute(factor, names);
  return result;
}

std::string words_for(const FuncPtr& factor) {
  std::string variables;
  for (const std::string& arg : factor->args) variables += (variables.empty() ? "" : ", ") + arg;
  return text(quoted(factor->name), " keeps a factor of its terms, which depends on (", variables,
              ") alone");
}

class Hoister {
 public:
  Hoister(const std::vector<FuncPtr>& outputs, ValuesOfVariable values)
      : graph_(outputs), values_(values) {
    for (const FuncPtr& f : graph_.order()) {
      if (is_invariant_factor(*f)) known_.push_back(f);
    }
  }

  FactoredGraph run() {
    for (const FuncPtr& f : graph_.order()) {
      if (graph_.is_copied(*f)) continue;
      FactorReads reads;
      const std::vector<Definition> stages = with_factors_found(*f, reads);
      if (!reads.empty() || graph_.reads_copies(*f)) graph_.copy(f, stages, reads);
    }
    return graph_.finish();
  }

 private:
  // The stages of f, and in `reads` the calls that replace factors of their terms.
  std::vector<Definition> with_factors_found(const FuncContents& f, FactorReads& reads) {
    std::vector<Definition> stages = stages_of(f);
    if (!is_users(f)) return stages;
    for (size_t s = 1; s < stages.size(); ++s) {
      if (!has_candidates(f, stages[s])) continue;
      // A factor could not take the variables of lets along.
      const Definition plain = map_exprs(stages[s], [](const Expr& e) { return without_lets(e); });
      const auto values = [&](const std::string& variable) {
        return values_(f, static_cast<int>(s), variable);
      };
      const std::vector<Expr> factors = Factors(f, plain, values).find();
      if (factors.empty()) continue;
      stages[s] = plain;
      for (const Expr& factor : factors) reads[factor.get()] = read_of(f, plain, factor, values);
    }
    return stages;
  }

  // A call of the factor's Func, which is made unless the graph has it.
  Expr read_of(const FuncContents& f, const Definition& update, const Expr& factor,
               ValuesInStage values) {
    const FactorDefinition definition = definition_of(f, update, graph_.redirected(factor), values);
    const auto known =
        std::ranges::find_if(known_, [&](const FuncPtr& g) { return definition.is_of(*g); });
    FuncPtr g = known == known_.end() ? nullptr : *known;
    if (g && graph_.reads_copies(*g)) {
      if (!graph_.is_copied(*g)) graph_.copy(g, stages_of(*g));
      g = graph_.copy_of(*g);
    } else if (!g) {
      g = make_func(Role::SharedValue, f.name + "_factor", f.name);
      define_pure(g, variables_of(definition.args), {definition.value});
      known_.push_back(g);
      graph_.add_factor(g, words_for(g));
    }
    return call_func(g->name, factor.type(), definition.at, 0, SymbolRef(g));
  }

  GraphFactoring graph_;
  const ValuesOfVariable values_;
  std::vector<FuncPtr> known_;  // factors, of this graph and new ones
};

}  // namespace

bool is_invariant_factor(const FuncContents& f) {
  return f.made && f.made->role == Role::SharedValue && !f.made->of.empty();
}

FactoredGraph hoist_invariant_factors(const std::vector<FuncPtr>& outputs,
                                      ValuesOfVariable values) {
  return Hoister(outputs, values).run();
}

std::vector<FuncPtr> with_invariant_factors(const std::vector<FuncPtr>& outputs, SumOrder order) {
  std::optional<SizeEstimate> sizes;  // an analysis of the graph, which few programs need
  const auto range = [&](const FuncContents& f, int, const std::string& variable) {
    if (!sizes) sizes.emplace(outputs);
    const auto arg = std::ranges::find(f.args, variable);
    return sizes->range(f, static_cast<size_t>(arg - f.args.begin()));
  };
  const FactoredGraph coarse = hoist_coarse_values(outputs, range, order);
  if (!coarse.factors.empty()) sizes.reset();
  const auto values = [&](const FuncContents& f, int stage,
                          const std::string& variable) -> std::optional<int64_t> {
    for (const ReductionVariable& r : f.stage(stage).rvars) {
      if (r.var == variable) return as_const_int(simplify(r.extent));
    }
    if (!sizes) sizes.emplace(coarse.outputs);
    const auto arg = std::ranges::find(f.args, variable);
    return sizes->extent(f, static_cast<size_t>(arg - f.args.begin()));
  };
  return hoist_invariant_factors(coarse.outputs, values).outputs;
}

}  // namespace retrograde::transform
