// function.cpp -- walks over the graph of Funcs.
#include "graph/function.h"

#include <unordered_map>
#include <unordered_set>

#include "diagnostics/error.h"
#include "graph/definitions/first_reads.h"
#include "graph/directives/wrappers.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/walk_once.h"

namespace retrograde::graph {

namespace {

// Depth-first search without recursion: chains of thousands of Funcs are legal.
class Sorter {
 public:
  std::vector<FuncPtr> sort(const std::vector<FuncPtr>& outputs) {
    for (const FuncPtr& output : outputs) {
      if (enter(output)) run();
    }
    return std::move(order_);
  }

 private:
  enum class State { Open, Done };
  struct Frame {
    FuncPtr func;
    std::vector<FuncPtr> callees;
    size_t next = 0;
  };
  std::unordered_map<const FuncContents*, State> state_;
  std::vector<Frame> stack_;
  std::vector<FuncPtr> order_;

  bool enter(const FuncPtr& f) {
    auto [it, is_new] = state_.try_emplace(f.get(), State::Open);
    if (!is_new) {
      if (it->second == State::Open) report_recursion(f);
      return false;
    }
    if (!f->is_defined()) report_undefined(f);
    stack_.push_back({f, direct_callees(*f)});
    return true;
  }

  void run() {
    while (!stack_.empty()) {
      Frame& frame = stack_.back();
      if (frame.next < frame.callees.size()) {
        const FuncPtr callee = frame.callees[frame.next++];
        enter(callee);
      } else {
        state_[frame.func.get()] = State::Done;
        order_.push_back(frame.func);
        stack_.pop_back();
      }
    }
  }

  std::string path_to(const FuncPtr& f, bool from_f) const {
    std::string path;
    bool on = !from_f;
    for (const Frame& frame : stack_) {
      on = on || frame.func == f;
      if (on) path += quoted(frame.func->name) + " -> ";
    }
    return path + quoted(f->name);
  }

  [[noreturn]] void report_recursion(const FuncPtr& f) const {
    user_error("order the Funcs that " + quoted(stack_.front().func->name) + " depends on",
               "Funcs may not depend on each other in a circle", "the calls go " + path_to(f, true),
               "A Func may read itself in an update definition over an RDom");
  }

  [[noreturn]] void report_undefined(const FuncPtr& f) const {
    user_error("compile a pipeline with the Func " + quoted(f->name),
               "every Func that is used needs a definition",
               stack_.empty() ? "it is an output" : "it is reached by " + path_to(f, false),
               "Define it before it is used: f(x, y) = ...");
  }
};

}  // namespace

int total_bytes(const std::vector<Type>& types) {
  int bytes = 0;
  for (Type type : types) bytes += type.bytes();
  return bytes;
}

const char* role_name(Role role) {
  switch (role) {
#define RETROGRADE_ROLE(Name, text) \
  case Role::Name:                  \
    return text;
#include "graph/definitions/roles.def"
  }
  return "";
}

FuncPtr make_func(Role role) {
  FuncPtr f = std::make_shared<FuncContents>();
  f->made.emplace().role = role;
  return f;
}

FuncPtr make_func(Role role, const std::string& name, const std::string& of) {
  FuncPtr f = make_func(role);
  f->made->of = of;
  f->name = claim_name(name);
  return f;
}

const Provenance* provenance_of(const Call& call) {
  if (call.call_type != CallType::Func || !call.symbol.defined()) return nullptr;
  const auto& made = static_cast<const FuncContents*>(call.symbol.raw())->made;
  return made ? &*made : nullptr;
}

FuncPtr func_of(const Call& call) {
  FuncPtr f = std::dynamic_pointer_cast<FuncContents>(call.symbol.lock());
  RETROGRADE_ASSERT(f != nullptr, "the Func behind the call of ", quoted(call.name), " is gone");
  return f;
}

std::vector<FuncPtr> topological_order(const std::vector<FuncPtr>& outputs) {
  return Sorter().sort(outputs);
}

std::vector<FuncPtr> direct_callees(const FuncContents& f) {
  std::vector<FuncPtr> callees;
  std::unordered_set<const Symbol*> seen;
  for (const Call* call : first_reads(f)) {
    if (call->call_type != CallType::Func || call->symbol.raw() == &f) continue;
    seen.insert(call->symbol.raw());
    callees.push_back(func_of(*call));
  }
  if (f.extern_definition) {
    for (const ExternArgument& arg : f.extern_definition->args) {
      if (arg.kind == ExternArgument::Kind::Func && seen.insert(arg.func.get()).second)
        callees.push_back(arg.func);
    }
  }
  return callees;
}

namespace {

// Visits the defined expressions of a definition, mutably if the definition is mutable.
template <class AnyDefinition, class Visit>
void visit_exprs(AnyDefinition& definition, const Visit& visit) {
  const auto visit_defined = [&](auto& e) {
    if (e.defined()) visit(e);
  };
  for (auto& arg : definition.args) visit_defined(arg);
  for (auto& value : definition.values) visit_defined(value);
  visit_defined(definition.predicate);
  for (auto& rvar : definition.rvars) {
    visit_defined(rvar.min);
    visit_defined(rvar.extent);
  }
}

}  // namespace

const ReductionVariable* point_number(const Definition& definition) {
  const auto& rvars = definition.rvars;
  return !rvars.empty() && rvars.back().numbers_points ? &rvars.back() : nullptr;
}

int number_of_points(const Definition& definition) {
  const ReductionVariable* number = point_number(definition);
  return number ? static_cast<int>(*as_const_int(number->extent)) : 1;
}

void for_each_expr(const Definition& definition, const std::function<void(const Expr&)>& visit) {
  visit_exprs(definition, visit);
}

void for_each_expr(const FuncContents& f, const std::function<void(const Expr&)>& visit) {
  for (int s = 0; s < f.stage_count(); ++s) for_each_expr(f.stage(s), visit);
}

Definition map_exprs(const Definition& definition, const std::function<Expr(const Expr&)>& map) {
  Definition result = definition;
  visit_exprs(result, [&](Expr& e) { e = map(e); });
  return result;
}

namespace {

using ParameterPtr = std::shared_ptr<ParameterContents>;

class ParameterCollector {
 public:
  void add_expr(const Expr& root) {
    if (!root.defined()) return;
    walk_once(root, seen_exprs_, [&](const Expr& e) {
      if (const Variable* v = e.as<Variable>()) add_symbol(v->symbol);
      if (const Call* call = e.as<Call>(); call && call->call_type == CallType::Image)
        add_symbol(call->symbol);
      return true;
    });
  }

  // Schedules and bounds may mention parameters too.
  void add_schedule(const FuncContents& f) {
    for (const Bound& bound : f.schedule.bounds) {
      for (const Expr& e : {bound.min, bound.extent, bound.modulus, bound.remainder}) add_expr(e);
    }
    for (const StorageRule& rule : f.schedule.storage_rules) {
      for (const Expr& e : {rule.alignment, rule.bound, rule.fold}) add_expr(e);
    }
    add_expr(f.schedule.ring);
    add_expr(f.schedule.eviction_key);
    for (int i = 0; i < f.stage_count(); i++) add_stage(f.stage(i).schedule);
    if (f.extern_definition) {
      for (const ExternArgument& arg : f.extern_definition->args) {
        add_expr(arg.expr);
        if (arg.buffer) add_symbol(SymbolRef(arg.buffer));
      }
    }
    for (const ParameterPtr& output : f.outputs) add_constraints(*output);
  }

  std::vector<ParameterPtr> take() { return std::move(found_); }
  void exclude(const ParameterPtr& parameter) { excluded_.insert(parameter.get()); }

 private:
  std::vector<ParameterPtr> found_;
  std::unordered_set<const Symbol*> seen_, excluded_;
  NodeSet seen_exprs_;

  void add_stage(const StageLoops& schedule) {
    for (const Split& split : schedule.splits) add_expr(split.factor);
    for (const PrefetchDirective& prefetch : schedule.prefetches) add_expr(prefetch.offset);
    for (const StageLoops& special : schedule.specializations) {
      add_expr(special.condition);
      add_stage(special);
    }
  }

  void add_symbol(const SymbolRef& symbol) {
    if (!symbol.defined() || excluded_.count(symbol.raw())) return;
    ParameterPtr parameter = std::dynamic_pointer_cast<ParameterContents>(symbol.lock());
    if (!parameter || !seen_.insert(parameter.get()).second) return;
    found_.push_back(parameter);
    add_constraints(*parameter);
  }

  void add_constraints(const ParameterContents& parameter) {
    for (const BufferConstraint& constraint : parameter.constraints) {
      add_expr(constraint.min);
      add_expr(constraint.extent);
      add_expr(constraint.stride);
    }
    add_expr(parameter.min_value);
    add_expr(parameter.max_value);
  }
};

void check_names(const std::vector<ParameterPtr>& parameters) {
  std::unordered_map<std::string, const ParameterContents*> by_name;
  for (const ParameterPtr& parameter : parameters) {
    if (by_name.emplace(parameter->name, parameter.get()).second) continue;
    user_error("compile a pipeline with the parameter " + quoted(parameter->name),
               "parameters of one pipeline have different names",
               "two of them are called " + quoted(parameter->name), "Rename one of them");
  }
}

}  // namespace

std::vector<ParameterPtr> parameters_of(const std::vector<FuncPtr>& outputs) {
  ParameterCollector collector;
  // Constraints on an output's own buffer mention that output, which is not an input.
  for (const FuncPtr& output : outputs) {
    for (const ParameterPtr& parameter : output->outputs) collector.exclude(parameter);
  }
  for (const FuncPtr& f : functions_of(outputs)) {
    for_each_expr(*f, [&](const Expr& e) { collector.add_expr(e); });
    collector.add_schedule(*f);
  }
  for (const FuncPtr& output : outputs) {
    for (const Requirement& requirement : output->requirements) {
      collector.add_expr(requirement.condition);
      for (const Expr& part : requirement.message) collector.add_expr(part);
    }
  }
  std::vector<ParameterPtr> parameters = collector.take();
  check_names(parameters);
  return parameters;
}

}  // namespace retrograde::graph
