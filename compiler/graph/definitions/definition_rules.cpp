#include "graph/definitions/definition_rules.h"

#include <algorithm>
#include <unordered_set>

#include "diagnostics/error.h"
#include "graph/definitions/own_reads.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/literal.h"
#include "ir/overflow.h"
#include "ir/print.h"
#include "ir/walk_once.h"

namespace retrograde::graph {

namespace {

std::string list(const std::vector<Expr>& exprs) {
  return "(" + listed(exprs, [](const Expr& e) { return text(e); }) + ")";
}

bool mentions_undef(const Expr& root) {
  return any_node(root, [](const Expr& e) { return is_undef(e); });
}

// A plain Var, as opposed to a parameter or reduction variable, which carry a symbol.
const Variable* as_plain_var(const Expr& e) {
  const Variable* v = e.as<Variable>();
  return v && !v->symbol.defined() && v->type == Int(32) ? v : nullptr;
}

// Why an expression has no single value in a call; empty when it has one.
std::string varying_part(const Expr& root) {
  std::string part;
  walk(root, [&](const Expr& e) {
    if (!part.empty()) return false;
    if (const Variable* v = e.as<Variable>()) {
      if (!std::dynamic_pointer_cast<ParameterContents>(v->symbol.lock()))
        part = text(quoted(v->name), " is a variable of loops");
    }
    if (const Call* call = e.as<Call>()) {
      if (call->call_type == CallType::Func)
        part = text(e, " is a value of the Func ", quoted(call->name));
      if (call->call_type == CallType::Image)
        part = text(e, " is an element of the image ", quoted(call->name));
      if (call->is_op(Op::random)) part = text(e, " is random");
    }
    return part.empty();
  });
  return part;
}

// Whether the Func or one that it reads, directly or not, reads `wanted`.
bool reads(const FuncContents& f, const FuncContents& wanted) {
  std::vector<FuncPtr> open = direct_callees(f);
  std::unordered_set<const FuncContents*> seen;
  while (!open.empty()) {
    const FuncPtr next = open.back();
    open.pop_back();
    if (next.get() == &wanted) return true;
    if (seen.insert(next.get()).second) append(open, direct_callees(*next));
  }
  return false;
}

// The advice about an update whose value has another type than that of the first definition. Most often the first
// definition is a constant such as 0, whose type the user did not think of.
std::string advice_on_type(const FuncContents& f, size_t i, Type first, Type given) {
  const bool starts_from_constant =
      f.is_defined() && i < f.pure->values.size() && is_const(f.pure->values[i]);
  if (!starts_from_constant || !given.is_float() || first.is_float())
    return text("Convert the right-hand side: cast(", to_string(first), ", ...)");
  const Expr& start = f.pure->values[i];
  const std::string literal =
      given == Float(32) && first == Int(32) ? text(start, ".0f, in Python ", start, ".0") : "";
  return text("The constant ", start, " of the first definition is of type ", to_string(first),
              ". Start from a constant of the type ", to_string(given), ": ",
              literal.empty() ? text("cast(", to_string(given), ", ", start, ")") : literal,
              is_zero(start)
                  ? ". Or leave the first definition out: += starts from a 0 of its operand's type"
                  : "");
}

}  // namespace

NamesInDefinition names_in(const FuncContents& f, const std::vector<Expr>& roots) {
  NamesInDefinition names;
  NodeSet visited;
  std::unordered_set<std::string> bound;
  std::unordered_set<const Symbol*> called;
  for (const Expr& root : roots) {
    if (!root.defined()) continue;
    walk_once(root, visited, [&](const Expr& e) {
      if (const Variable* v = e.as<Variable>()) names.free.push_back(v);
      if (const Let* let = e.as<Let>()) bound.insert(let->name);
      const Call* call = e.as<Call>();
      if (call && call->call_type == CallType::Func) {
        if (call->symbol.raw() == &f) {
          names.self_calls.push_back(call);
        } else if (called.insert(call->symbol.raw()).second) {
          names.callees.push_back(func_of(*call));
        }
      }
      return true;
    });
  }
  std::erase_if(names.free, [&](const Variable* v) { return bound.count(v->name) != 0; });
  return names;
}

DefinitionRules::DefinitionRules(const FuncContents& f, const std::vector<Expr>& args,
                                 bool is_update)
    : f_(f) {
  for (const Expr& arg : args) {
    if (arg.defined()) continue;
    user_error("define " + quoted(f.name),
               "every argument on the left-hand side must be a defined expression",
               "one of them was never assigned", "Assign every Expr before it is used");
  }
  asked_ = text(is_update ? "update " : "define ", quoted(f.name), list(args));
}

// ---- of every definition ----

void DefinitionRules::check_values(const std::vector<Expr>& values) const {
  if (values.empty())
    user_error(asked_, "a definition has at least one value", "the Tuple is empty",
               "Give it an Expr");
  for (size_t i = 0; i < values.size(); i++) {
    if (!values[i].defined()) {
      user_error(asked_, "the right-hand side must be a defined expression",
                 values.size() == 1 ? "it was never assigned"
                                    : text("element ", i, " of the Tuple was never assigned"),
                 "Assign every Expr before it is used");
    }
  }
}

void DefinitionRules::check_coordinates(const std::vector<Expr>& args,
                                        const std::vector<Expr>& exprs) const {
  const auto refuse = [&](const Expr& coordinate, const std::string& where) {
    user_error(asked_, "a coordinate has a value, and undef has none",
               text("the coordinate ", coordinate, " ", where, " comes from undef"),
               "Give the place a value, and store undef there to leave it as it is");
  };
  for (const Expr& arg : args)
    if (mentions_undef(arg)) refuse(arg, "on the left-hand side");
  for (const Expr& root : exprs) {
    if (!mentions_undef(root)) continue;
    walk(root, [&](const Call& call) {
      if (call.call_type != CallType::Func && call.call_type != CallType::Image) return;
      for (const Expr& arg : call.args)
        if (mentions_undef(arg)) refuse(arg, "of " + quoted(call.name));
    });
  }
}

void DefinitionRules::check_constants(const std::vector<Expr>& exprs) const {
  for (const Expr& root : exprs) {
    const Expr part = overflowing_part(root);
    if (!part.defined()) continue;
    user_error(asked_, "constants of int32 and int64 do not overflow",
               text(part, " does not fit ", to_string(part.type())),
               "Cast an operand to a wider type, or to an unsigned one, which wraps around");
  }
}

void DefinitionRules::check_free_variables(const NamesInDefinition& names,
                                           const std::vector<std::string>& args) const {
  for (const Variable* v : names.free) {
    const bool is_arg = std::ranges::find(args, v->name) != args.end();
    if (v->symbol.defined()) {
      if (is_arg && !domain_of(*v)) {
        user_error(asked_, "a parameter and a pure variable of one definition have different names",
                   "both are called " + quoted(v->name), "Rename the Var or the Param");
      }
      continue;
    }
    if (is_arg) continue;
    if (implicit_index(v->name) >= 0 || is_placeholder(v->name)) {
      user_error(asked_, "a right-hand side that uses _ needs _ on the left-hand side",
                 text("it uses ", quoted(v->name)),
                 text("Write ", quoted(f_.name), "(..., _) = ..."));
    }
    user_error(asked_,
               "every variable on the right-hand side appears on the left-hand side, or belongs to "
               "an RDom",
               text(quoted(v->name), " appears only on the right-hand side"),
               "Add it as an argument, or reduce over an RDom");
  }
}

DomainPtr DefinitionRules::domain_in(const NamesInDefinition& names, DomainPtr result) const {
  for (const Variable* v : names.free) {
    auto domain = domain_of(*v);
    if (!domain) continue;
    if (result && domain != result) {
      user_error(
          asked_, "all reduction variables of one definition come from one RDom",
          text(quoted(v->name), " and ", quoted(result->vars[0].var), " are of different RDoms"),
          "Make one RDom with all of the variables");
    }
    result = domain;
  }
  return result;
}

// ---- of the pure definition ----

void DefinitionRules::check_is_first() const {
  if (f_.is_defined())
    user_error(asked_, "a Func is defined once", "it has a definition already", "Update it");
}

std::vector<std::string> DefinitionRules::pure_names(const std::vector<Expr>& args) const {
  std::vector<std::string> names;
  for (const Expr& arg : args) {
    const Variable* v = as_plain_var(arg);
    if (!v) {
      user_error(asked_, "the arguments of a first definition are Vars", text(arg, " is not a Var"),
                 "Define all points first, as in f(x) = 0, then update some of them");
    }
    if (std::ranges::find(names, v->name) != names.end()) {
      user_error(asked_, "the arguments of a first definition are different Vars",
                 quoted(v->name) + " appears twice", "Use a Var of its own for each dimension");
    }
    names.push_back(v->name);
  }
  return names;
}

void DefinitionRules::check_declared(size_t dimensions, const std::vector<Expr>& values) const {
  if (f_.required_dimensions >= 0 && static_cast<int>(dimensions) != f_.required_dimensions) {
    user_error(asked_, "a definition has the dimensions that the Func was declared with",
               text("it was declared with ", f_.required_dimensions, " and is given ", dimensions),
               "Give that many arguments");
  }
  if (!f_.required_types.empty()) check_types(values, f_.required_types, "the declaration");
}

void DefinitionRules::check_no_reduction(const DomainPtr& domain) const {
  if (!domain) return;
  user_error(asked_, "a first definition has no reduction variables",
             text("it uses ", quoted(domain->vars[0].var)),
             "Reduce in an update, f(x) += ..., or inside the expression with sum(...)");
}

// ---- of updates ----

void DefinitionRules::check_is_updatable(const NamesInDefinition& names) const {
  if (!f_.is_defined())
    user_error(asked_, "a Func is updated after its first definition", "it has none",
               "Define it first: f(x) = 0");
  if (f_.is_extern()) {
    user_error(asked_, "a Func that a C function computes has no updates",
               text("it is defined by ", quoted(f_.extern_definition->function)),
               "Update a Func that reads it");
  }
  if (f_.frozen) {
    check_direct_reads(names);
    user_error(asked_, "a Func is complete when another Func uses it",
               "another Func uses it already",
               "Move the update before that use, or put it into a new Func");
  }
}

void DefinitionRules::check_direct_reads(const NamesInDefinition& names) const {
  for (const FuncPtr& callee : names.callees) {
    if (!reads(*callee, f_)) continue;
    user_error(
        asked_, "a Func is complete when another Func uses it",
        text("the right-hand side reads ", quoted(without_numbers(callee->name)), ", which reads ",
             quoted(f_.name),
             " and would have to be computed between two iterations of this update"),
        "Make each step a Func of its own, in a loop of the program around the definitions: "
        "step n reads step n - 1. An inline reduction such as sum(...) is another Func, too");
  }
}

void DefinitionRules::check_arity(const std::vector<Expr>& args) const {
  if (args.size() == f_.args.size()) return;
  user_error(asked_, "all definitions of a Func have the same number of arguments",
             text("its first definition has ", f_.args.size(), " and this one ", args.size()),
             "Give the same number of arguments");
}

void DefinitionRules::check_types(const std::vector<Expr>& values, const std::vector<Type>& types,
                                  const char* whose) const {
  if (values.size() != types.size()) {
    user_error(asked_, "all definitions of a Func have the same number of values",
               text(whose, " has ", types.size(), " and this one has ", values.size()),
               "Give the same number of values");
  }
  for (size_t i = 0; i < types.size(); i++) {
    if (values[i].type() == types[i]) continue;
    user_error(asked_, "all definitions of a Func have the same types",
               text(whose, values.size() > 1 ? text(" for element ", i) : std::string(), " gives ",
                    to_string(types[i]), " and this one ", to_string(values[i].type())),
               advice_on_type(f_, i, types[i], values[i].type()));
  }
}

std::vector<Expr> DefinitionRules::update_coordinates(const std::vector<Expr>& args) const {
  std::vector<Expr> result;
  for (const Expr& arg : args) {
    if (!arg.type().is_int_or_uint() || !arg.type().is_scalar()) {
      user_error(asked_, "coordinates are integers", text(arg, " has type ", to_string(arg.type())),
                 "Convert it: cast<int>(...)");
    }
    result.push_back(int32_literal(arg, asked_));
  }
  return result;
}

std::vector<std::string> DefinitionRules::pure_positions(const std::vector<Expr>& args) const {
  std::vector<std::string> result(args.size());
  for (size_t i = 0; i < args.size(); i++) {
    const Variable* v = as_plain_var(args[i]);
    if (v && v->name == f_.args[i]) result[i] = v->name;
  }
  return result;
}

void DefinitionRules::check_self_calls(const NamesInDefinition& names,
                                       const std::vector<std::string>& pure) const {
  for (const Call* call : names.self_calls) {
    for (size_t i = 0; i < pure.size(); i++) {
      if (pure[i].empty()) continue;
      const Variable* v = call->args[i].as<Variable>();
      if (v && v->name == pure[i]) continue;
      user_error(asked_,
                 "a pure variable keeps its position in every reference of a Func to itself, "
                 "so that its "
                 "iterations are independent",
                 text("the right-hand side reads ", quoted(f_.name), list(call->args),
                      ", where argument ", i, " is not ", quoted(pure[i])),
                 "Use an RDom for the dimension that the recurrence runs along");
    }
  }
}

void DefinitionRules::check_bounds(const ReductionDomainContents& domain) const {
  for (const ReductionVariable& v : domain.vars) {
    for (const Expr& bound : {v.min, v.extent}) {
      if (!any_node(bound, [&](const Call& call) { return is_call_of(call, &f_); })) continue;
      user_error(asked_, "the bounds of a reduction domain are known before its update runs",
                 text("the domain of ", quoted(v.var), " has the bound ", bound, ", which reads ",
                      quoted(f_.name), " itself"),
                 text("Compute the bound in another Func, or give the domain a constant bound and "
                      "say with RDom::where which points count"));
    }
  }
}

void check_over_parameters(const Expr& e, const char* what, const std::string& asked) {
  const std::string part = varying_part(e);
  if (part.empty()) return;
  user_error(asked,
             text(what,
                  " has one value in each call: it is made of parameters and facts "
                  "about buffers"),
             part, "Use a Param, or a fact such as in.dim(0).extent()");
}

}  // namespace retrograde::graph
