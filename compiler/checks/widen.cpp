#include "checks/widen.h"

#include "autodiff/sums/generated_definitions.h"
#include "autodiff/sweeps/local_derivative.h"
#include "diagnostics/error.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"
#include "graph/definitions/define.h"
#include "graph/function.h"
#include "ir/build.h"

namespace retrograde::checks {

namespace {

Type wide(Type t) { return t.is_float() ? Float(64, t.lanes()) : t; }

class Widening {
 public:
  Widening(const std::vector<FuncPtr>& outputs, const Rounding& rounding) : rounding_(rounding) {
    for (const auto& p : parameters_of(outputs)) {
      if (p->type.is_float()) result_.parameters[p.get()] = wide_parameter(*p);
    }
    for (const FuncPtr& f : topological_order(outputs)) add(f);
  }
  Widened take() { return std::move(result_); }

 private:
  static std::shared_ptr<ParameterContents> wide_parameter(const ParameterContents& p) {
    const std::string name = claim_name(p.name + "_double");
    return p.is_buffer ? ImageParam(Float(64), p.dimensions, name).parameter()
                       : Param<double>(name).parameter();
  }

  [[noreturn]] static void refuse(const std::string& what) {
    unsupported("evaluate the pipeline in double", "every operation needs a meaning in double",
                "it contains " + what, "Check the part of the pipeline around it");
  }

  void add(const FuncPtr& f) {
    if (f->is_extern())
      refuse(text("the C function ", quoted(f->extern_definition->function), " behind ",
                  quoted(f->name)));
    auto to = make_func(Role::Widened);
    to->name = claim_name(f->name + "_double");
    to->made->of = f->name;
    result_.funcs[f.get()] = to;
    const std::vector<Expr> args = variables_of(f->args);
    for (int s = 0; s < f->stage_count(); ++s) {
      Definition d = map_exprs(f->stage(s), [&](const Expr& e) { return widened(e); });
      if (rounding_.amount.defined()) round(d, *f, s);
      if (s == 0) {
        define_pure(to, args, d.values);
      } else {
        autodiff::append_update(to, d.args, d.values, d.rvars, d.predicate);
      }
    }
  }

  // Values that are only copied are not rounded: constants, reads, `undef`.
  static bool is_computed(const Expr& value) {
    if (value.as<FloatImm>() || !value.type().is_float()) return false;
    const Call* call = value.as<Call>();
    return !call || (call->call_type == CallType::Operator && call->op != Op::undef);
  }
  void round(Definition& d, const FuncContents& f, int stage) {
    std::vector<Expr> words{rounding_.seed, make_const(Int(32), funcs_seen_++), Expr(stage)};
    for (const std::string& arg : f.args) {
      for (const Expr& e : d.args) {
        if (const Variable* v = e.as<Variable>(); v && v->name == arg) words.push_back(e);
      }
    }
    for (const ReductionVariable& r : d.rvars) words.push_back(variable(r.var));
    for (Expr& value : d.values) {
      if (!is_computed(value)) continue;
      words.push_back(make_const(Int(32), static_cast<int>(words.size())));  // number of this value
      Expr u = cast_to(Float(64), call_op(Op::random, Float(32), words));
      value = value * (1.0 + rounding_.amount * (2.0 * u - 1.0));
    }
  }

  Expr widened(const Expr& root) {
    return rewrite(without_lets(root),
                   [&](const Expr& e, const auto& recurse) { return node(e, recurse); });
  }

  using Recurse = std::function<Expr(const Expr&)>;

  Expr node(const Expr& e, const Recurse& recurse) {
    return match(
        e, [&](const FloatImm&) { return make_const(Float(64), *as_const_float(e)); },
        [&](const Variable& v) { return scalar(e, v); },
        [&](const Cast& c) { return cast_to(wide(c.type), recurse(c.value)); },
        [&](const Reinterpret& r) -> Expr {
          if (r.type.is_float() || r.value.type().is_float()) refuse("the bits of a float");
          return map_children(e, recurse);
        },
        [&](const Binary& b) { return binary(e.kind(), recurse(b.a), recurse(b.b)); },
        [&](const Select& s) {
          return make_select(recurse(s.condition), recurse(s.when_true), recurse(s.when_false));
        },
        [&](const Call& c) { return call(c, recurse); },
        [&](const ExprNode&) { return map_children(e, recurse); });
  }

  Expr scalar(const Expr& e, const Variable& v) {
    auto found = result_.parameters.find(v.symbol.raw());
    return found == result_.parameters.end()
               ? e
               : variable(found->second->name, Float(64), SymbolRef(found->second));
  }

  Expr call(const Call& c, const Recurse& recurse) {
    const std::vector<Expr> args = mapped(c.args, recurse);
    switch (c.call_type) {
      case CallType::Operator:
        return operation(c, args);
      case CallType::Func: {
        const FuncPtr& to = result_.funcs.at(c.symbol.raw());
        return call_func(to->name, wide(c.type), args, c.component, SymbolRef(to));
      }
      case CallType::Image: {
        auto found = result_.parameters.find(c.symbol.raw());
        return found == result_.parameters.end()
                   ? call_image(c.name, c.type, args, c.symbol)
                   : call_image(found->second->name, Float(64), args, SymbolRef(found->second));
      }
      case CallType::Extern:
        break;
    }
    refuse("a call of the C function " + retrograde::quoted(c.name));
  }

  static Expr operation(const Call& c, const std::vector<Expr>& args) {
    if (c.op == Op::random) return cast_to(wide(c.type), call_op(c.op, c.type, args));
    if (c.op == Op::fast_inverse) return make_one(args[0].type()) / args[0];
    if (c.op == Op::fast_inverse_sqrt)
      return make_one(args[0].type()) / call_op(Op::sqrt, args[0].type(), args);
    return call_op(exact_form(c.op), wide(c.type), args);
  }

  Rounding rounding_;
  int funcs_seen_ = 0;
  Widened result_;
};

}  // namespace

Widened widen(const std::vector<FuncPtr>& outputs, const Rounding& rounding) {
  return Widening(outputs, rounding).take();
}

}  // namespace retrograde::checks
