#include <algorithm>

#include "diagnostics/error.h"
#include "graph/directive_text.h"
#include "graph/graph.h"
#include "ir/equal.h"
#include "ir/print.h"

namespace retrograde::ir {

namespace {

// Walks two graphs side by side and keeps the first difference.
class Comparer {
 public:
  std::string run(const Graph& a, const Graph& b) {
    compare_all("parameters", a.parameters, b.parameters,
                [&](const std::string& at, const auto& x, const auto& y) { compare(at, *x, *y); });
    compare_all("Funcs", a.funcs, b.funcs,
                [&](const std::string& at, const auto& x, const auto& y) { compare(at, *x, *y); });
    compare_all(
        "outputs", a.outputs, b.outputs,
        [&](const std::string& at, const auto& x, const auto& y) { compare_output(at, *x, *y); });
    return std::move(found_);
  }

 private:
  template <typename T>
  void check(const std::string& at, const T& a, const T& b) {
    if (found_.empty() && !(a == b)) found_ = text(at, ": ", shown(a), " and ", shown(b));
  }
  template <typename T>
  static const T& shown(const T& value) {
    return value;
  }
  static std::string shown(const std::vector<std::string>& names) {
    std::string out;
    for (const std::string& name : names) out += name + " ";
    return out;
  }
  void check_expr(const std::string& at, const Expr& a, const Expr& b) {
    if (!found_.empty()) return;
    if (a.defined() != b.defined() || (a.defined() && !equal(a, b)))
      found_ = text(at, ": ", print_argument(a), " and ", print_argument(b));
  }
  void check_exprs(const std::string& at, const std::vector<Expr>& a, const std::vector<Expr>& b) {
    compare_all(at, a, b, [&](const std::string& place, const Expr& x, const Expr& y) {
      check_expr(place, x, y);
    });
  }
  template <typename T, typename Compare>
  void compare_all(const std::string& at, const std::vector<T>& a, const std::vector<T>& b,
                   const Compare& compare_one) {
    check("number of " + at, a.size(), b.size());
    for (size_t i = 0; found_.empty() && i < a.size(); ++i)
      compare_one(text(at, " ", i), a[i], b[i]);
  }
  template <typename T>
  static std::string name_or_none(const std::shared_ptr<T>& p) {
    return p ? p->name : "none";
  }

  void compare(const std::string& at, const ParameterContents& a, const ParameterContents& b) {
    check(at + ", name", a.name, b.name);
    check(at + ", type", to_string(a.type), to_string(b.type));
    check(at + ", dimensions", a.dimensions, b.dimensions);
    check(at + ", is a buffer", a.is_buffer, b.is_buffer);
    check(at + ", is a Buffer of the program", a.is_literal, b.is_literal);
    const auto value_of = [](const ParameterContents& p) {
      return p.value ? to_expr(*p.value) : Expr();
    };
    check_expr(at + ", value", value_of(a), value_of(b));
    check_expr(at + ", least value", a.min_value, b.min_value);
    check_expr(at + ", largest value", a.max_value, b.max_value);
    check_expr(at + ", estimate", a.estimate, b.estimate);
    check(at + ", reader", name_or_none(a.func), name_or_none(b.func));
    compare_constraints(at, a, b);
    compare(at, a.trace, b.trace);
  }
  void compare_constraints(const std::string& at, const ParameterContents& a,
                           const ParameterContents& b) {
    check(at + ", alignment", a.host_alignment, b.host_alignment);
    compare_all(
        at + ", dimension", a.constraints, b.constraints,
        [&](const std::string& place, const BufferConstraint& x, const BufferConstraint& y) {
          check_exprs(place, {x.min, x.extent, x.stride, x.min_estimate, x.extent_estimate},
                      {y.min, y.extent, y.stride, y.min_estimate, y.extent_estimate});
          check(place + ", any stride", x.any_stride, y.any_stride);
        });
  }
  void compare(const std::string& at, const TraceSchedule& a, const TraceSchedule& b) {
    check(at + ", traced loads", a.loads, b.loads);
    check(at + ", traced stores", a.stores, b.stores);
    check(at + ", traced realizations", a.realizations, b.realizations);
    check(at + ", trace tags", a.tags, b.tags);
  }

  void compare(const std::string& at, const FuncContents& a, const FuncContents& b) {
    check(at + ", name", a.name, b.name);
    check(a.name + ", variables", a.args, b.args);
    compare_all(a.name + ", types", a.types, b.types,
                [&](const std::string& place, Type x, Type y) {
                  check(place, to_string(x), to_string(y));
                });
    compare(a.name, a.made, b.made);
    compare(a.name, a.extern_definition, b.extern_definition);
    check(a.name + ", number of stages", a.stage_count(), b.stage_count());
    for (int s = 0; found_.empty() && s < a.stage_count(); ++s)
      compare(text(a.name, ", stage ", s), a.stage(s), b.stage(s), first_loops(a, a.stage(s)));
    compare_logs(a.name, directives_of(a), directives_of(b));
    compare_wrappers(a, b);
  }
  void compare_wrappers(const FuncContents& a, const FuncContents& b) {
    const auto named = [](const FuncContents& f) {
      std::vector<std::string> result;
      for (const auto& [user, wrapper] : f.wrappers) result.push_back(user + ":" + wrapper->name);
      return result;
    };
    check(a.name + ", wrappers", named(a), named(b));
  }
  void compare(const std::string& at, const std::optional<Provenance>& a,
               const std::optional<Provenance>& b) {
    check(at + ", made by the compiler", a.has_value(), b.has_value());
    if (!a || !b) return;
    check(at + ", role", std::string(role_name(a->role)), std::string(role_name(b->role)));
    check(at + ", made of", a->of, b->of);
    check(at + ", same traits", true, a->traits == b->traits);
    check(at + ", lanes", a->lanes, b->lanes);
    check(at + ", parts", a->has_parts, b->has_parts);
    compare_all(at + ", work", a->work, b->work,
                [&](const std::string& place, const AdjointWork& x, const AdjointWork& y) {
                  check_exprs(place + ", values", x.values, y.values);
                  check_exprs(place + ", loops", x.loops, y.loops);
                });
  }
  void compare(const std::string& at, const std::optional<ExternDefinition>& a,
               const std::optional<ExternDefinition>& b) {
    check(at + ", computed by a C function", a.has_value(), b.has_value());
    if (!a || !b) return;
    check(at + ", C function", a->function, b->function);
    check(at + ", mangling", static_cast<int>(a->mangling), static_cast<int>(b->mangling));
    compare_all(at + ", argument", a->args, b->args,
                [&](const std::string& place, const ExternArgument& x, const ExternArgument& y) {
                  check(place, static_cast<int>(x.kind), static_cast<int>(y.kind));
                  check(place, name_or_none(x.func), name_or_none(y.func));
                  check(place, name_or_none(x.buffer), name_or_none(y.buffer));
                  check_expr(place, x.expr, y.expr);
                });
  }

  void compare(const std::string& at, const Definition& a, const Definition& b,
               const std::vector<Dim>& first) {
    check_exprs(at + ", places", a.args, b.args);
    check_exprs(at + ", values", a.values, b.values);
    check_expr(at + ", predicate", a.predicate, b.predicate);
    compare_all(
        at + ", reduction variables", a.rvars, b.rvars,
        [&](const std::string& place, const ReductionVariable& x, const ReductionVariable& y) {
          check(place, x.var, y.var);
          check_exprs(place, {x.min, x.extent}, {y.min, y.extent});
        });
    compare(at, a.schedule, b.schedule, first);
  }
  void compare(const std::string& at, const StageSchedule& a, const StageSchedule& b,
               const std::vector<Dim>& first) {
    if (!found_.empty()) return;
    check_expr(at + ", condition", a.condition, b.condition);
    check(at + ", failure", a.failure, b.failure);
    compare_logs(at, directives_of(a, first), directives_of(b, first));
    compare_all(at + ", specializations", a.specializations, b.specializations,
                [&](const std::string& place, const StageSchedule& x, const StageSchedule& y) {
                  compare(place, x, y, first);
                });
  }
  void compare_logs(const std::string& at, const std::vector<Directive>& a,
                    const std::vector<Directive>& b) {
    compare_all(at + ", directives", a, b,
                [&](const std::string& place, const Directive& x, const Directive& y) {
                  if (found_.empty() && !equal(x, y))
                    found_ = text(place, ": ", to_text(x), " and ", to_text(y));
                });
  }

  void compare_output(const std::string& at, const FuncContents& a, const FuncContents& b) {
    check(at, a.name, b.name);
    compare_all(at + ", buffers", a.outputs, b.outputs,
                [&](const std::string& place, const auto& x, const auto& y) {
                  compare_constraints(place, *x, *y);
                });
    compare_all(at + ", requirements", a.requirements, b.requirements,
                [&](const std::string& place, const Requirement& x, const Requirement& y) {
                  check_expr(place, x.condition, y.condition);
                  check_exprs(place, x.message, y.message);
                });
  }

  std::string found_;
};

}  // namespace

std::string difference(const Graph& a, const Graph& b) { return Comparer().run(a, b); }

}  // namespace retrograde::ir
