// Checks the rules of the algorithm IR, each of which has a name, Func by Func.
#include <algorithm>
#include <unordered_set>

#include "diagnostics/error.h"
#include "graph/directives/directive.h"
#include "graph/graph.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::graph {

namespace {

class GraphValidator {
 public:
  GraphValidator(const Graph& graph, const std::string& pass) : graph_(graph), pass_(pass) {
    for (const FuncPtr& f : graph.funcs) {
      known_.insert(f.get());
      for (const auto& output : f->outputs) known_.insert(output.get());
    }
    for (const auto& parameter : graph.parameters) known_.insert(parameter.get());
  }

  void run() {
    std::unordered_set<std::string> names;
    for (const FuncPtr& f : graph_.funcs) {
      require(names.insert(f->name).second, *f, "names of Funcs are unique");
      check(*f);
    }
    for (const FuncPtr& f : graph_.outputs)
      require(known_.count(f.get()) != 0, *f, "an output is a Func of the graph");
  }

 private:
  [[noreturn]] void fail(const FuncContents& f, const std::string& rule,
                         const std::string& where) const {
    throw InternalError(
        text("after this pass the program breaks a rule of the phase Algorithm: ", rule,
             "\n  in the Func ", quoted(f.name), where.empty() ? "" : ": " + where),
        pass_, to_text(graph_));
  }
  void require(bool holds, const FuncContents& f, const char* rule) const {
    if (!holds) fail(f, rule, "");
  }
  void require(bool holds, const FuncContents& f, const char* rule, const Expr& e) const {
    if (!holds) fail(f, rule, print(e));
  }

  void check(const FuncContents& f) const {
    require(f.is_defined(), f, "every Func has a definition");
    require(std::unordered_set<std::string>(f.args.begin(), f.args.end()).size() == f.args.size(),
            f, "the variables of a Func are different");
    require(std::is_permutation(f.args.begin(), f.args.end(), f.schedule.storage_dims.begin(),
                                f.schedule.storage_dims.end()),
            f, "storage has the dimensions of the Func");
    for (int s = 0; s < f.stage_count(); ++s) check(f, f.stage(s), s > 0);
    for (const auto& entry : f.wrappers)
      require(known_.count(entry.second.get()) != 0, f, "a wrapper is a Func of the graph");
    for (const auto& entry : f.copied_inputs)
      require(known_.count(entry.second.get()) != 0, f, "a copied input is a Func of the graph");
  }

  void check(const FuncContents& f, const Definition& stage, bool is_update) const {
    require(stage.args.size() == f.args.size(), f,
            "a definition has a coordinate for each dimension");
    for (const Expr& place : stage.args)
      require(place.type() == Int(32), f, "coordinates are of type int32", place);
    if (is_update || !f.is_extern()) {
      require(stage.values.size() == f.types.size(), f, "a definition has a value for each type");
      for (size_t i = 0; i < stage.values.size(); ++i)
        require(stage.values[i].type() == f.types[i], f, "values have the types of the Func",
                stage.values[i]);
    }
    if (stage.predicate.defined())
      require(stage.predicate.type() == Bool(), f, "predicates are of type bool", stage.predicate);
    require(is_update || stage.rvars.empty(), f, "a first definition has no reduction variables");
    std::unordered_set<std::string> bound(f.args.begin(), f.args.end());
    for (const ReductionVariable& v : stage.rvars)
      require(bound.insert(v.var).second, f, "the variables of a definition are different");
    check_points(f, stage);
    for_each_expr(stage, [&](const Expr& e) { check_names(f, e, bound); });
    check(f, stage.schedule, first_loops(f, stage));
  }

  void check_points(const FuncContents& f, const Definition& stage) const {
    for (const ReductionVariable& v : stage.rvars) {
      if (!v.numbers_points) continue;
      const auto points = as_const_int(v.extent);
      require(&v == &stage.rvars.back() && is_zero(v.min) && points && *points > 0, f,
              "points are numbered by the last reduction variable, from 0 to a constant");
    }
  }

  // Every variable is bound by its definition or a let, or is a parameter or buffer metadata.
  void check_names(const FuncContents& f, const Expr& root,
                   std::unordered_set<std::string> bound) const {
    walk(root, [&](const Let& let) { bound.insert(let.name); });
    walk(root, [&](const Expr& e) {
      if (const Variable* v = e.as<Variable>()) {
        require(bound.count(v->name) || (v->symbol.defined() && known_.count(v->symbol.raw())), f,
                "a variable belongs to its definition or its reduction domain, or is a parameter "
                "of the graph",
                e);
      }
      if (const Call* call = e.as<Call>()) check(f, *call, e);
      return true;
    });
  }

  void check(const FuncContents& f, const Call& call, const Expr& e) const {
    if (call.call_type == CallType::Image)
      require(known_.count(call.symbol.raw()) != 0, f,
              "an image that is read is a parameter of the graph", e);
    if (call.call_type != CallType::Func) return;
    require(known_.count(call.symbol.raw()) != 0, f, "a Func that is read belongs to the graph", e);
    const auto& callee = *static_cast<const FuncContents*>(call.symbol.raw());
    require(callee.name == call.name, f, "a call has the name of its Func", e);
    require(callee.args.size() == call.args.size(), f, "a call has a coordinate for each dimension",
            e);
    const bool has_value =
        call.component >= 0 && call.component < static_cast<int>(callee.types.size());
    require(has_value && callee.types[static_cast<size_t>(call.component)] == call.type, f,
            "a call has the type of the value that it reads", e);
  }

  // A schedule's loops are the result of its directives on the first loops.
  void check(const FuncContents& f, const StageLoops& schedule,
             const std::vector<Dim>& first) const {
    StageLoops built;
    built.dims = first;
    for (const Directive& directive : directives_of(schedule, first))
      apply_directive(directive, built);
    const bool same = std::equal(built.dims.begin(), built.dims.end(), schedule.dims.begin(),
                                 schedule.dims.end(), [](const Dim& a, const Dim& b) {
                                   return a.var == b.var && a.runs == b.runs &&
                                          a.is_reduction == b.is_reduction &&
                                          a.partition == b.partition;
                                 });
    require(same, f, "the loops of a stage are what its directives make of its variables");
    for (const StageLoops& special : schedule.specializations) {
      if (special.failure.empty()) check(f, special, first);
    }
  }

  const Graph& graph_;
  const std::string& pass_;
  std::unordered_set<const Symbol*> known_;
};

}  // namespace

void validate(const Graph& graph, const std::string& after_pass) {
  GraphValidator(graph, after_pass).run();
}

}  // namespace retrograde::graph
