#include "autodiff/sweeps/custom_rules.h"

#include <algorithm>
#include <unordered_set>

#include "autodiff/rules/derivative_rules.h"
#include "autodiff/sums/generated_definitions.h"
#include "autodiff/sweeps/input_shape.h"
#include "diagnostics/error.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "graph/function.h"
#include "graph/names.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

bool is_among(const std::vector<AdjointInput>& inputs, const Symbol* symbol) {
  return std::ranges::any_of(inputs,
                             [&](const AdjointInput& i) { return i.symbol().get() == symbol; });
}

// Only reads of values count: queries of a buffer's shape are no reads.
std::shared_ptr<Symbol> read_symbol(const Expr& e) {
  if (const auto* call = e.as<Call>())
    return call->symbol.defined() ? call->symbol.lock() : nullptr;
  const auto* v = e.as<Variable>();
  if (!v || !v->symbol.defined()) return nullptr;
  auto p = std::dynamic_pointer_cast<ParameterContents>(v->symbol.lock());
  return p && !p->is_buffer ? p : nullptr;
}

class Readers {
 public:
  explicit Readers(const FuncContents& f) : f_(f) {
    for_each_expr(f, [&](const Expr& e) { add_expr(e); });
    if (!f.extern_definition) return;
    for (const ExternArgument& a : f.extern_definition->args) {
      if (a.func) add(a.func);
      if (a.buffer) add(a.buffer);
      if (a.expr.defined()) add_expr(a.expr);
    }
  }
  std::vector<std::shared_ptr<Symbol>> take() { return std::move(found_); }

 private:
  void add_expr(const Expr& root) {
    walk(root, [&](const Expr& e) {
      if (auto symbol = read_symbol(e)) add(symbol);
      return true;
    });
  }
  void add(const std::shared_ptr<Symbol>& symbol) {
    if (symbol.get() != &f_ && seen_.insert(symbol.get()).second) found_.push_back(symbol);
  }
  const FuncContents& f_;
  std::unordered_set<const Symbol*> seen_;
  std::vector<std::shared_ptr<Symbol>> found_;
};

Region region_of(const Box& box) {
  return mapped(box, [](const Interval& i) {
    return Range{i.min, i.is_bounded() ? extent_of(i) : Expr()};
  });
}

std::string asked_through(const FuncContents& f) {
  return "propagate adjoints through " + quoted(f.name);
}

// Checks that every wanted input that f depends on is an input of the rule.
std::vector<FuncPtr> check_covered(const FuncContents& f,
                                   FunctionRef<bool(const Symbol*)> is_wanted,
                                   FunctionRef<bool(const Symbol*)> is_requested) {
  std::vector<FuncPtr> covered;
  for (const Inside& inside : inside_of(f, custom_rules_of(f)->adjoint_inputs)) {
    if (!is_wanted(inside.symbol.get())) continue;
    auto func = std::dynamic_pointer_cast<FuncContents>(inside.symbol);
    if (!func || is_requested(func.get())) {
      user_error(asked_through(f),
                 "its custom adjoint must know every input whose gradient is wanted",
                 text(quoted(inside.reader), " reads ", quoted(shape_of(inside.symbol.get()).name),
                      ", which is not among the inputs of the rule"),
                 "List it in custom_adjoint and give its contribution, if only "
                 "AdjointContribution::zero; or leave it out of what is differentiated by");
    }
    covered.push_back(func);
  }
  return covered;
}

// Checks that each wanted input has one contribution of the right shape.
void check_contributions(const FuncContents& f, const std::vector<AdjointContribution>& returned,
                         FunctionRef<bool(const Symbol*)> is_wanted) {
  const std::vector<AdjointInput> inputs = custom_rules_of(f)->adjoint_inputs;
  std::unordered_set<const Symbol*> seen;
  for (const AdjointContribution& c : returned) {
    InputShape shape = shape_of(c.input.symbol().get());
    if (!is_among(inputs, c.input.symbol().get())) {
      user_error(asked_through(f), "a rule contributes to the inputs that it was made for",
                 text("its custom adjoint gives one to ", quoted(shape.name)),
                 "List it in custom_adjoint");
    }
    if (!seen.insert(c.input.symbol().get()).second) {
      user_error(asked_through(f), "each input gets one contribution",
                 text("its custom adjoint gives two to ", quoted(shape.name)),
                 "Add them in one Func");
    }
    if (c.is_zero) continue;
    check_shape(asked_through(f), "a contribution", "its input", shape, *c.adjoint.function());
  }
  for (const AdjointInput& input : inputs) {
    const Symbol* symbol = input.symbol().get();
    if (!is_wanted(symbol) || seen.contains(symbol)) continue;
    user_error(asked_through(f), "each wanted input gets a contribution",
               text("its custom adjoint gives none to ", quoted(shape_of(symbol).name)),
               "Return one, or AdjointContribution::zero where the derivative is zero");
  }
}

// `returned` as an adjoint. The rule may return values that are exactly 0 where the partials of the input are infinite,
// and infinite where they are 0, so the result has both traits.
FuncPtr as_adjoint(const std::string& name, const FuncPtr& returned) {
  FuncPtr result = make_func(Role::CustomRule, name);
  result->made->traits = {.masked = true, .singular = true};
  const std::vector<Expr> args = variables_of(implicit_names(returned->dimensions()));
  define_pure(result, args, mapped(values_of(returned, args), [](const Expr& value) {
                return cast_to(adjoint_type(value.type()), value);
              }));
  return result;
}

}  // namespace

std::shared_ptr<const CustomDerivatives> custom_rules_of(const FuncContents& f) {
  return std::static_pointer_cast<const CustomDerivatives>(f.custom_derivatives);
}
bool has_custom_adjoint(const FuncContents& f) {
  return f.custom_derivatives && custom_rules_of(f)->adjoint;
}
bool has_custom_tangent(const FuncContents& f) {
  return f.custom_derivatives && custom_rules_of(f)->tangent;
}

std::vector<std::shared_ptr<Symbol>> read_by(const FuncContents& f) { return Readers(f).take(); }

std::vector<Inside> inside_of(const FuncContents& f, const std::vector<AdjointInput>& inputs) {
  std::vector<Inside> found;
  std::unordered_set<const Symbol*> seen = {&f};
  std::vector<const FuncContents*> open = {&f};
  while (!open.empty()) {
    const FuncContents* reader = open.back();
    open.pop_back();
    for (const std::shared_ptr<Symbol>& symbol : read_by(*reader)) {
      if (is_among(inputs, symbol.get()) || !seen.insert(symbol.get()).second) continue;
      found.push_back({symbol, reader->name});
      if (const auto* func = dynamic_cast<const FuncContents*>(symbol.get())) open.push_back(func);
    }
  }
  return found;
}

Box extern_reads(const FuncContents& f, const std::shared_ptr<Symbol>& argument, int dimensions,
                 const Box& of_func) {
  Box box(static_cast<size_t>(dimensions));
  const ExternReads reads = has_custom_adjoint(f) ? custom_rules_of(f)->reads : ExternReads();
  if (!reads) return box;
  Region region = reads(AdjointInput(argument), region_of(of_func));
  if (region.empty()) return box;
  if (region.size() != box.size()) {
    user_error(asked_through(f), "a region has min and extent in each dimension of the argument",
               text("what its custom adjoint says of ", quoted(shape_of(argument.get()).name),
                    " has ", region.size(), " dimensions instead of ", box.size()),
               "Give each dimension, or an empty Region for all of the argument");
  }
  for (size_t d = 0; d < box.size(); ++d) {
    const Range& r = region[d];
    if (!r.min.defined()) continue;
    box[d].min = simplify(r.min);
    if (r.extent.defined()) box[d].max = simplify(r.min + r.extent - 1);
  }
  return box;
}

CustomAdjointResult run_custom_adjoint(const FuncPtr& f, const FuncPtr& adjoint,
                                       const Regions& regions,
                                       FunctionRef<bool(const Symbol*)> is_wanted,
                                       FunctionRef<bool(const Symbol*)> is_requested) {
  CustomAdjointResult result;
  result.covered = check_covered(*f, is_wanted, is_requested);
  std::vector<AdjointContext::Wanted> wanted;
  // Holds the rules, because another thread may replace them while the rule runs.
  const std::shared_ptr<const CustomDerivatives> rules = custom_rules_of(*f);
  for (const AdjointInput& input : rules->adjoint_inputs) {
    const Symbol* symbol = input.symbol().get();
    if (is_wanted(symbol)) wanted.push_back({symbol, region_of(regions.of(symbol))});
  }
  if (wanted.empty()) return result;
  std::vector<AdjointContribution> returned = rules->adjoint(
      AdjointContext(Func(f), Func(adjoint), region_of(regions.of(f.get())), wanted));
  check_contributions(*f, returned, is_wanted);
  for (const AdjointContribution& c : returned) {
    if (!is_wanted(c.input.symbol().get())) continue;
    std::string name = shape_of(c.input.symbol().get()).name;
    if (c.is_zero) {
      result.zeros.push_back(name);
    } else {
      result.contributions.push_back(
          {c.input.symbol(), as_adjoint(name + "_from_" + f->name, c.adjoint.function())});
    }
  }
  return result;
}

FuncPtr run_custom_tangent(const FuncPtr& f, FunctionRef<FuncPtr(const Symbol*)> tangent_of,
                           FunctionRef<bool(const Symbol*)> has_direction) {
  std::string asked = "propagate tangents through " + quoted(f->name);
  bool moves = false;
  for (const auto& symbol : read_by(*f)) moves |= tangent_of(symbol.get()) != nullptr;
  const std::shared_ptr<const CustomDerivatives> rules = custom_rules_of(*f);
  TangentContext::Moving moving;
  for (const AdjointInput& input : rules->tangent_inputs) {
    if (FuncPtr t = tangent_of(input.symbol().get()))
      moving.push_back({input.symbol().get(), Func(t)});
  }
  if (!moves && moving.empty()) return nullptr;
  if (!has_custom_tangent(*f)) {
    unsupported(
        asked, "a Func with a custom adjoint needs a rule for tangents, too",
        "an input of it moves, and it has none: its definitions need not agree with the rule",
        "Give it a custom_tangent, or give its tangent itself as a direction");
  }
  for (const Inside& inside : inside_of(*f, rules->tangent_inputs)) {
    if (!has_direction(inside.symbol.get())) continue;
    user_error(asked, "its custom tangent must know every input that moves",
               text(quoted(inside.reader), " reads ", quoted(shape_of(inside.symbol.get()).name),
                    ", which has a direction and is not among the inputs of the rule"),
               "List it in custom_tangent");
  }
  if (moving.empty()) return nullptr;
  Func returned = rules->tangent(TangentContext(Func(f), rules->tangent_inputs, moving));
  check_shape(asked, "the tangent that its rule gives", "the Func",
              {f->name, f->dimensions(), f->types}, *returned.function());
  return as_adjoint(f->name + "_tan", returned.function());
}

FuncPtr zero_derivative(const Symbol& symbol, const std::string& suffix) {
  InputShape shape = shape_of(&symbol);
  FuncPtr zero = make_func(Role::CustomRule, shape.name + suffix, shape.name);
  define_pure(zero, variables_of(implicit_names(shape.dimensions)),
              mapped(shape.types, [](Type t) { return make_zero(adjoint_type(t)); }));
  return zero;
}

}  // namespace retrograde::autodiff
