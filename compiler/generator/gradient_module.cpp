// gradient_module.cpp -- builds the module that computes the gradient of a generator.
//
//   y = f(a, w)   =>   (a, w, L_y) -> (L_a, L_w)     L_v: the derivative of a loss L with respect to v
//
// The caller chooses the loss L and passes L_y, its gradient at the output. With several outputs there is one gradient
// for each pair of output and input; the caller sums those that it needs. Names, order and types of the arguments are
// those of Halide's gradient modules, which cover images only.
// Gradients with respect to integer images are zero. So are those of integer outputs, whose values do not change under
// small changes of the inputs; L_y is float for these. If y does not read an image, its gradient is zero, has the type
// of L_y, and its name begins with _dummy.
//
// Separate gradients are an alternative for callers that need only some of the gradients. They are those of the sum
// over all outputs, computed in one backward pass, include scalar inputs, and omit gradients that are known to be 0.
#include <optional>
#include <set>

#include "autodiff/derivative.h"
#include "generator/generator_base.h"

namespace retrograde::internal {

namespace {

Region region_of(const ImageParam& image) {
  return ir::numbered(image.dimensions(), [&](int d) {
    return Range{image.dim(d).min(), image.dim(d).extent()};
  });
}

struct NamedOutput {
  std::string name;
  Func func;
};

std::vector<NamedOutput> named_outputs(const std::vector<GeneratorOutputBase*>& outputs) {
  std::vector<NamedOutput> result;
  for (const GeneratorOutputBase* output : outputs) {
    const std::vector<Func> funcs = output->funcs();
    for (size_t i = 0; i < funcs.size(); i++) result.push_back({output->element_name(i), funcs[i]});
  }
  return result;
}

// Checks that every output has one value and that at least one output is of floats.
void check_differentiable(const std::vector<NamedOutput>& outputs, const std::string& generator) {
  const std::string asked = "build the gradient of the generator " + quoted(generator);
  std::string types;
  bool has_floats = false;
  for (const auto& [name, f] : outputs) {
    if (f.outputs() != 1) {
      user_error(asked, "gradients are of outputs with one value",
                 quoted(f.name()) + text(" has ", f.outputs(), " values"),
                 "Split the Tuple into outputs");
    }
    has_floats = has_floats || f.type().is_float();
    types += (types.empty() ? "" : ", ") + quoted(f.name()) + " holds " + to_string(f.type());
  }
  if (has_floats) return;
  user_error(asked, "gradients are of floating-point outputs", types,
             "Make one an output of floats");
}

// Adds the seed of an output, the gradient L_y, as the next argument.
ImageParam add_seed(const NamedOutput& output, std::vector<Argument>& arguments,
                    std::vector<std::string>& names) {
  names.push_back("_grad_loss_for_" + output.name);
  const Type type = output.func.type().is_float() ? output.func.type() : Float(32);
  ImageParam seed(type, output.func.dimensions(), names.back());
  arguments.push_back(frontend::argument_of(*seed.parameter()));
  return seed;
}

AdjointInput adjoint_input(const std::shared_ptr<graph::ParameterContents>& parameter) {
  return AdjointInput(std::shared_ptr<ir::Symbol>(parameter));
}

Func zeros(const Type& type, int dimensions) {
  Func f("zeros");
  f(ir::numbered(dimensions, [&](int d) { return Var::implicit(d); })) = cast(type, 0);
  return f;
}

std::set<std::string> inputs_of(const Func& f) {
  std::set<std::string> names;
  for (const Argument& argument : f.infer_arguments()) names.insert(argument.name);
  return names;
}

}  // namespace

std::vector<ImageParam> GeneratorBase::image_inputs(std::vector<std::string>& names) const {
  std::vector<ImageParam> images;
  for (const GeneratorInputBase* input : members_.inputs) {
    if (input->kind() == IOKind::Scalar) continue;
    for (size_t i = 0; i < input->values().size(); i++) {
      images.push_back(ImageParam(input->values()[i].parameter));
      names.push_back(input->element_name(i));
    }
  }
  return images;
}

Module GeneratorBase::build_gradient_module(const std::string& function_name) {
  generate_all();
  std::vector<Argument> arguments = input_arguments();
  std::vector<std::string> names = input_names(), gradient_names, image_names;
  const std::vector<ImageParam> images = image_inputs(image_names);
  AdjointOptions options;
  for (const ImageParam& image : images) options.wrt.push_back(image);

  const std::vector<NamedOutput> outputs = named_outputs(members_.outputs);
  check_differentiable(outputs, name_);

  std::vector<Func> gradients;
  std::set<const graph::FuncContents*> seen;
  for (const NamedOutput& output : outputs) {
    const ImageParam seed = add_seed(output, arguments, names);
    std::optional<Derivative> derivative;
    if (output.func.type().is_float())
      derivative = propagate_adjoints(output.func, seed, region_of(seed), options);
    const std::set<std::string> read = inputs_of(output.func);
    for (size_t k = 0; k < images.size(); k++) {
      const graph::ParameterContents& image = *images[k].parameter();
      const bool is_read = read.count(image.name) > 0;
      const bool has = is_read && derivative && derivative->has(images[k]);
      Func gradient = has ? (*derivative)(images[k])
                          : zeros(is_read ? image.type : seed.type(), image.dimensions);
      if (!seen.insert(gradient.function().get()).second) gradient = lambda(gradient(_));
      gradients.push_back(gradient);
      gradient_names.push_back((is_read ? "_grad_loss_" : "_dummy_grad_loss_") + output.name +
                               "_wrt_" + image_names[k]);
    }
  }
  names.insert(names.end(), gradient_names.begin(), gradient_names.end());
  Pipeline pipeline(gradients);
  add_requirements(pipeline);
  auto_schedule_pipeline(pipeline);
  return to_module(pipeline, arguments, names, function_name, LinkageType::ExternalPlusMetadata);
}

std::vector<GeneratorBase::NamedParameter> GeneratorBase::differentiable_inputs() const {
  std::vector<NamedParameter> inputs;
  for (const GeneratorInputBase* input : members_.inputs) {
    for (size_t i = 0; i < input->values().size(); i++) {
      const auto& parameter = input->values()[i].parameter;
      if (parameter && parameter->type.is_float())
        inputs.push_back({input->element_name(i), parameter});
    }
  }
  return inputs;
}

Module GeneratorBase::build_separate_gradients(const std::string& function_name) {
  generate_all();
  const std::string function = function_name.empty() ? name_ : function_name;
  const std::vector<NamedParameter> inputs = differentiable_inputs();
  if (inputs.empty()) {
    user_error("build the gradients of the generator " + quoted(name_),
               "gradients are with respect to floating-point inputs", "it has none",
               "Make an input one of floats");
  }
  std::vector<Module> modules{gradient_function(function, inputs)};
  for (const NamedParameter& input : inputs) {
    if (inputs.size() > 1)
      modules.push_back(gradient_function(function + "_by_" + input.first, {input}));
  }
  return link_modules(function, modules);
}

Module GeneratorBase::gradient_function(const std::string& function_name,
                                        const std::vector<NamedParameter>& by) {
  std::vector<Argument> arguments = input_arguments();
  std::vector<std::string> names = input_names();
  const std::vector<NamedOutput> outputs = named_outputs(members_.outputs);
  check_differentiable(outputs, name_);

  AdjointOptions options;
  for (const auto& [name, parameter] : by) options.wrt.push_back(adjoint_input(parameter));
  std::vector<OutputAdjoint> adjoints;
  for (const NamedOutput& output : outputs) {
    if (!output.func.type().is_float()) continue;
    const ImageParam seed = add_seed(output, arguments, names);
    adjoints.push_back({output.func, seed, region_of(seed)});
  }
  const Derivative derivative = propagate_adjoints(adjoints, options);
  std::vector<Func> gradients;
  std::set<const graph::FuncContents*> seen;
  for (const auto& [name, parameter] : by) {
    const AdjointInput input = adjoint_input(parameter);
    Func gradient = derivative.has(input) ? derivative.of(input)
                                          : zeros(parameter->type, parameter->dimensions);
    if (!seen.insert(gradient.function().get()).second) gradient = lambda(gradient(_));
    gradients.push_back(gradient);
    names.push_back("_grad_loss_wrt_" + name);
  }
  Pipeline pipeline(gradients);
  add_requirements(pipeline);
  auto_schedule_pipeline(pipeline);
  return to_module(pipeline, arguments, names, function_name, LinkageType::ExternalPlusMetadata);
}

}  // namespace retrograde::internal
