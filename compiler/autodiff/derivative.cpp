#include "autodiff/derivative.h"

#include <algorithm>

#include "autodiff/gradient_lookup.h"
#include "autodiff/report/explain_costs.h"
#include "autodiff/rules/derivative_rules.h"
#include "autodiff/sweeps/input_shape.h"
#include "autodiff/sweeps/omitted_gradients.h"
#include "autodiff/sweeps/regions.h"
#include "autodiff/sweeps/synthesis.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde {

namespace {

using namespace autodiff;

std::string asked_of_adjoints(const Func& output) {
  return "propagate adjoints from " + quoted(output.name());
}

void check_loss(const Func& output) {
  check_output(asked_of_adjoints(output), *output.function(),
               "Convert it to float where the gradient starts");
}

CheckpointBudget budget_of(const AdjointOptions& options) {
  const char* asked = "propagate adjoints with a budget for checkpoints";
  if (options.checkpoint_states && options.checkpoint_bytes)
    user_error(asked, "a budget is a number of states or of bytes",
               "both checkpoint_states and checkpoint_bytes are set", "Set one of them");
  int64_t states = options.checkpoint_states.value_or(1);
  int64_t bytes = options.checkpoint_bytes.value_or(1);
  if (states < 1 || bytes < 1)
    user_error(
        asked, "a loop is run backward from at least one kept state, the first",
        text("the budget is ", states < 1 ? states : bytes, states < 1 ? " states" : " bytes"),
        "Give a larger one");
  return {options.checkpoint_states.value_or(0), options.checkpoint_bytes.value_or(0)};
}

VersionRules rules_of(const AdjointOptions& options) {
  using Keep = VersionRules::Keep;
  if (options.version_bytes < 0)
    user_error("propagate adjoints with a budget for versions", "a budget is a number of bytes",
               text("version_bytes is ", options.version_bytes), "Give 0 or more");
  const Keep keep = options.overwritten == Overwritten::Auto    ? Keep::WithinBudget
                    : options.overwritten == Overwritten::Store ? Keep::Always
                                                                : Keep::Never;
  return {keep, options.version_bytes};
}

SynthesisOptions to_synthesis(const AdjointOptions& options) {
  SynthesisOptions result;
  result.versions = rules_of(options);
  result.only_requested = !options.wrt.empty();
  result.checkpoints = budget_of(options);
  for (const AdjointInput& input : options.wrt) result.requested.insert(input.symbol().get());
  return result;
}

Expr seed_value(const Func& output, size_t k, const Expr& value) {
  Type type = output.types()[k];
  return type.is_float() ? cast_to(adjoint_type(type), value) : Expr();
}

Derivative run(const Seeds& seeds, const AdjointOptions& options) {
  const SynthesisOptions how = to_synthesis(options);
  auto result = std::make_shared<SynthesisResult>(synthesize_supported(seeds, how));
  for (const AdjointInput& input : options.wrt) result->requested.push_back(input.symbol());
  return Derivative(result);
}

void check_dimensions(const Func& output, size_t bounds, int adjoint,
                      const std::string& adjoint_name) {
  if (static_cast<int>(bounds) != output.dimensions()) {
    user_error(asked_of_adjoints(output), "the output needs bounds in each of its dimensions",
               text("it has ", output.dimensions(), " dimensions and ", bounds, " bounds"),
               "Give min and extent of each dimension");
  }
  if (adjoint != output.dimensions()) {
    user_error(asked_of_adjoints(output), "an adjoint has the dimensions of its Func",
               text(quoted(adjoint_name), " has ", adjoint, " and ", quoted(output.name()), " has ",
                    output.dimensions()),
               "Define the adjoint over the same dimensions");
  }
}

Seed seed_of(const OutputAdjoint& given) {
  const auto& [output, adjoint, bounds] = given;
  check_loss(output);
  if (!adjoint.defined()) {
    user_error(asked_of_adjoints(output), "the adjoint must be defined",
               quoted(adjoint.name()) + " has no definition", "Define it before it is given");
  }
  check_dimensions(output, bounds.size(), adjoint.dimensions(), adjoint.name());
  if (adjoint.outputs() != output.outputs()) {
    user_error(asked_of_adjoints(output), "an adjoint has as many values as its Func",
               text(quoted(adjoint.name()), " has ", adjoint.outputs(), " and ",
                    quoted(output.name()), " has ", output.outputs()),
               "Define it as a Tuple of as many values, with zeros for values without an adjoint");
  }
  const FuncRef values = adjoint(variables_of(output.function()->args));
  return {output.function(), box_of(bounds), numbered(output.types().size(), [&](size_t k) {
            return seed_value(output, k, values.element(static_cast<int>(k)));
          })};
}

}  // namespace

Derivative::Derivative(std::shared_ptr<const SynthesisResult> result)
    : result_(std::move(result)), zeros_(std::make_shared<ZeroGradients>()) {}

Func Derivative::absent(const std::shared_ptr<const Symbol>& symbol,
                        const std::string& name) const {
  return Func(zeros_->find(symbol, name, result_->explanations));
}

bool Derivative::outputs_use(const FuncContents& f) const {
  const std::vector<FuncPtr> order = topological_order(mapped(result_->outputs, &WantedFunc::func));
  return std::ranges::any_of(order, [&](const FuncPtr& used) { return used.get() == &f; });
}

bool Derivative::has(const AdjointInput& input) const {
  const Symbol* symbol = input.symbol().get();
  const auto* f = dynamic_cast<const FuncContents*>(symbol);
  if (!f) return result_->parameters.contains(symbol);
  if (result_->after_stage.contains({symbol, f->stage_count() - 1})) return true;
  const auto image = image_read_by(*f);
  return image && result_->parameters.contains(image.get());
}

Func Derivative::operator()(const Func& func, int update_id) const {
  if (!func.defined()) {
    user_error("find the adjoint of " + quoted(func.name()), "a Func has a definition",
               "it has none", "Define it, and differentiate what depends on it");
  }
  if (update_id < -1 || update_id >= func.num_update_definitions()) {
    user_error(text("find the adjoint of ", quoted(func.name()), " after update ", update_id),
               "a Func has an adjoint after each of its definitions",
               text("it has ", func.num_update_definitions(), " updates, the first is 0"),
               "Name one of them, or -1 for the pure definition");
  }
  const FuncContents& f = *func.function();
  auto it = result_->after_stage.find({&f, update_id + 1});
  if (it != result_->after_stage.end()) return Func(it->second);
  const auto image = image_read_by(f);
  return image && !outputs_use(f) ? of_parameter(image) : absent(func.function(), f.name);
}

Func Derivative::adjoint(const Func& func) const {
  return (*this)(func, func.num_update_definitions() - 1);
}

Func Derivative::accumulator(const Func& adjoint) const {
  auto it = result_->accumulators.find(adjoint.function().get());
  return it == result_->accumulators.end() ? adjoint : Func(it->second);
}

Func Derivative::of(const AdjointInput& input) const {
  if (auto f = std::dynamic_pointer_cast<FuncContents>(input.symbol())) return adjoint(Func(f));
  return of_parameter(std::dynamic_pointer_cast<const ParameterContents>(input.symbol()));
}

Func Derivative::of_parameter(const std::shared_ptr<const ParameterContents>& parameter) const {
  auto it = result_->parameters.find(parameter.get());
  return it == result_->parameters.end() ? absent(parameter, parameter->name) : Func(it->second);
}
Func Derivative::operator()(const Buffer<>& buffer) const {
  return of_parameter(buffer.parameter());
}
Func Derivative::operator()(const ImageParam& image) const {
  return of_parameter(image.parameter());
}

std::vector<Func> Derivative::funcs() const {
  return {result_->funcs.begin(), result_->funcs.end()};
}

std::vector<Explanation> Derivative::explanations() const {
  std::vector<Explanation> all = result_->explanations;
  append(all, zeros_->explanations());
  return all;
}

std::vector<Explanation> Derivative::costs() const {
  GradientOperations counts = operations();
  return explain_costs(result_->outputs, result_->gradients, counts.primal, counts.gradient);
}

std::string Derivative::explain(Detail detail) const {
  std::vector<Explanation> all = explanations();
  append(all, costs());
  return to_string(all, detail);
}

GradientOperations Derivative::operations() const {
  return {count_operations(result_->outputs), count_operations(result_->gradients)};
}

std::optional<double> GradientOperations::ratio() const {
  auto before = primal.operations().value(), after = gradient.operations().value();
  if (!before || !after || *before == 0) return std::nullopt;
  return *after / *before;
}

Derivative propagate_adjoints(const Func& output, const Func& adjoint, const Region& output_bounds,
                              const AdjointOptions& options) {
  return run({seed_of({output, adjoint, output_bounds})}, options);
}

Derivative propagate_adjoints(const std::vector<OutputAdjoint>& outputs,
                              const AdjointOptions& options) {
  if (outputs.empty())
    user_error("propagate adjoints from several outputs", "there is at least one output",
               "none is given", "Give each output with its adjoint and its bounds");
  return run(mapped(outputs, seed_of), options);
}

Derivative propagate_adjoints(const Func& output, const Buffer<float>& adjoint,
                              const AdjointOptions& options) {
  check_loss(output);
  if (!adjoint.defined())
    user_error(asked_of_adjoints(output), "the adjoint must be a defined Buffer",
               "it has no memory", "Give it sizes: Buffer<float> adjoint(width, height)");
  check_dimensions(output, static_cast<size_t>(output.dimensions()), adjoint.dimensions(),
                   adjoint.name());
  Region region;
  for (int d = 0; d < adjoint.dimensions(); ++d)
    region.push_back({Expr(adjoint.min(d)), Expr(adjoint.extent(d))});
  Seed seed{output.function(), box_of(region), {}};
  auto parameter = adjoint.parameter();
  Expr value = call_image(parameter->name, parameter->type, variables_of(output.function()->args),
                          SymbolRef(parameter));
  for (size_t k = 0; k < output.types().size(); ++k)
    seed.values.push_back(seed_value(output, k, value));
  return run({seed}, options);
}

Derivative propagate_adjoints(const Func& output, const AdjointOptions& options) {
  check_loss(output);
  if (output.outputs() != 1) {
    user_error(asked_of_adjoints(output), "a scalar output has one value",
               text("it has ", output.outputs()),
               "Give the adjoint of each value as a Tuple-valued Func");
  }
  if (output.dimensions() != 0) {
    user_error(asked_of_adjoints(output),
               "the gradient is that of a scalar, or of a sum with given weights",
               text(quoted(output.name()), " has ", output.dimensions(), " dimensions"),
               "Sum its elements up in a Func without dimensions, as in loss() += f(r.x, r.y), or "
               "give the adjoint of each element: propagate_adjoints(f, adjoint, bounds)");
  }
  return run({{output.function(), {}, {seed_value(output, 0, make_one(output.type()))}}}, options);
}

}  // namespace retrograde
