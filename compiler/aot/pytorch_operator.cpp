// pytorch_operator.cpp -- see pytorch_operator.h.
#include "aot/pytorch_operator.h"

#include "aot/pytorch_text.h"
#include "diagnostics/error.h"

namespace retrograde::aot {
namespace {

// ---- kinds of inputs ----

bool is_float_number(const ExportArgument& input) {
  return !input.is_buffer() && input.type.is_float();
}

// Whether the input is a tensor if floating-point numbers are passed as tensors.
bool is_tensor(const ExportArgument& input) { return input.is_buffer() || is_float_number(input); }

bool is_differentiable(const ExportArgument& input) {
  return is_tensor(input) && input.type.is_float();
}

std::string parameter_type(const ExportArgument& input) {
  return input.is_buffer() ? "const at::Tensor&" : number_type(input);
}

std::string tensor_type(const ExportArgument& input) {
  return is_tensor(input) ? "const at::Tensor&" : number_type(input);
}

std::string tensor_parameter(const ExportArgument& input) {
  return tensor_type(input) + " " + name_of(input);
}

std::string tensor_schema(const ExportArgument& input) {
  const char* const type = is_tensor(input) ? "Tensor " : input.type.is_bool() ? "bool " : "int ";
  return type + name_of(input);
}

std::string schema(const ExportArgument& input) {
  return is_float_number(input) ? "float " + name_of(input) : tensor_schema(input);
}

// ---- results ----

std::string shape_function(const TorchFunction& function, const ExportArgument& output) {
  const ExportArgument* like = nullptr;
  for (const ExportArgument& image : function.images)
    if (!like && image.dimensions == output.dimensions) like = &image;
  std::string ranks;
  for (const ExportArgument& image : function.images) {
    ranks += text("  retrograde_torch::check_rank(\"", function.name, "\", \"", image.name, "\", ",
                  cpp_identifier(image.name), ", ", image.dimensions, ");\n");
  }
  const std::string otherwise =
      like ? "  const auto sizes = " + cpp_identifier(like->name) +
                 ".sym_sizes();\n  return {sizes.begin(), sizes.end()};"
           : "#error no input has the dimensions of the output: say its SHAPE";
  return filled(R"(
inline std::vector<c10::SymInt> shape_of_$output$($parameters$) {
$ranks$#ifdef RETROGRADE_TORCH_SHAPE_$output$
  return {RETROGRADE_TORCH_SHAPE_$output$};
#else
$otherwise$
#endif
}
)",
                {{"output", cpp_identifier(output.name)},
                 {"parameters", listed(function.inputs, parameter)},
                 {"ranks", ranks},
                 {"otherwise", otherwise}});
}

std::string results_type(size_t count) {
  const std::vector<std::string> types(count, "at::Tensor");
  return count == 1 ? types[0] : "std::tuple<" + joined(types) + ">";
}

std::string results_schema(size_t count) {
  const std::vector<std::string> types(count, "Tensor");
  return count == 1 ? types[0] : "(" + joined(types) + ")";
}

// Values for the results and their sizes.
void add_results(const TorchFunction& function, TextValues& values) {
  const std::string arguments = listed(function.inputs, name_of);
  const std::string options = name_of(function.images[0]) + ".options()";
  std::vector<std::string> empties, variables, outputs, applied;
  std::string shapes;
  for (const ExportArgument& output : function.outputs) {
    empties.push_back("at::empty_symint(shape_of_" + name_of(output) + "(" + arguments + "), " +
                      options + ".dtype(" + scalar_type(output) + "))");
    variables.push_back("  at::Tensor made_" + name_of(output) + " = " + empties.back() + ";\n");
    applied.push_back(text("results[", outputs.size(), "]"));
    outputs.push_back("made_" + name_of(output));
    shapes += shape_function(function, output);
  }
  const std::string type = results_type(outputs.size());
  values.insert({{"results", type},
                 {"results_schema", results_schema(outputs.size())},
                 {"results_of_apply", type + "(" + joined(applied) + ")"},
                 {"shapes", shapes},
                 {"empties", joined(empties)},
                 {"empty_variables", joined(variables, "")},
                 {"outputs", joined(outputs)}});
}

// ---- arguments ----

// Values for the arguments, in two forms: floating-point numbers as numbers, and as tensors.
void add_arguments(const TorchFunction& function, TextValues& values) {
  std::vector<std::string> tensors, wanting, images_wanting;
  for (const ExportArgument& input : function.inputs) {
    if (!is_tensor(input)) continue;
    tensors.push_back(name_of(input));
    wanting.push_back(name_of(input) + ".requires_grad()");
    if (input.is_buffer()) images_wanting.push_back(wanting.back());
  }
  const auto value = [&](const ExportArgument& input) {
    return is_float_number(input) ? "number_of(\"" + function.name + "\", \"" + input.name +
                                        "\", " + name_of(input) + ")"
                                  : name_of(input);
  };
  const auto boxed = [](const ExportArgument& input) {
    return is_float_number(input) ? "at::scalar_tensor(" + name_of(input) + ", at::kDouble)"
                                  : name_of(input);
  };
  const bool has_numbers = tensors.size() > images_wanting.size();
  values.insert(
      {{"function", function.name},
       {"place", text("retrograde_torch::Place::", function.on_device ? "device" : "host")},
       {"arguments", listed(function.inputs, name_of)},
       {"parameters", listed(function.inputs, parameter)},
       {"types", listed(function.inputs, parameter_type)},
       {"schema", listed(function.inputs, schema)},
       {"tensor_parameters", listed(function.inputs, tensor_parameter)},
       {"tensor_types", listed(function.inputs, tensor_type)},
       {"tensor_schema", listed(function.inputs, tensor_schema)},
       {"tensors", joined(tensors)},
       {"values", listed(function.inputs, value)},
       {"boxed_arguments", listed(function.inputs, boxed)},
       {"any_requires_grad", joined(wanting, " || ")},
       {"any_image_requires_grad", joined(images_wanting, " || ")},
       {"overload", has_numbers ? "tensors" : ""},
       {"dot_overload", has_numbers ? ".tensors" : ""},
       {"run", has_numbers ? "run_of_tensors" : "run"},
       {"made", has_numbers ? "made_of_tensors" : "made"}});
  values["numbers"] = has_numbers ? filled(pytorch_numbers_text, values) : "";
  values["register_numbers"] = has_numbers ? filled(pytorch_register_numbers_text, values) : "";
}

// ---- the gradient ----

void add_seeds(const TorchFunction& function, TextValues& values) {
  std::vector<std::string> seeds, parameters, types, schemas, given, wanting;
  for (size_t i = 0; i < function.outputs.size(); i++) {
    if (!function.outputs[i].type.is_float()) continue;
    const std::string seed = "seed_" + name_of(function.outputs[i]);
    seeds.push_back(seed);
    parameters.push_back("const at::Tensor& " + seed);
    types.push_back("const at::Tensor&");
    schemas.push_back("Tensor " + seed);
    given.push_back(text("seeds[", i, "].contiguous()"));
    wanting.push_back(seed + ".requires_grad()");
  }
  for (auto* list : {&parameters, &types}) list->push_back("int64_t");
  parameters.back() += " wanted";
  schemas.push_back("int wanted");
  given.push_back("wanted");
  values.insert({{"seeds", joined(seeds)},
                 {"backward_parameters", values["tensor_parameters"] + ", " + joined(parameters)},
                 {"backward_types", values["tensor_types"] + ", " + joined(types)},
                 {"backward_arguments", values["arguments"] + ", " + joined(seeds) + ", wanted"},
                 {"backward_schema", values["tensor_schema"] + ", " + joined(schemas)},
                 {"seed_list", joined(given)},
                 {"any_seed_requires_grad", joined(wanting, " || ")}});
}

// `wanted` has one bit for each differentiable input, in order.
void add_gradients(const TorchFunction& function, TextValues& values) {
  std::vector<std::string> variables, outputs, results;
  std::string made, alone;
  for (const ExportArgument& input : function.inputs) {
    if (!is_differentiable(input)) continue;
    const std::string name = name_of(input), by = "by_" + name;
    const std::string options = name + ".options()";
    const std::string size = input.is_buffer() ? "_symint(" + name + ".sym_sizes(), " : "({}, ";
    const std::string type = ".dtype(" + scalar_type(input) + ")";
    const std::string variable =
        "    at::Tensor " + by + " = at::empty" + size + options + type + ");\n";
    const std::string result = input.is_buffer() ? by : by + ".to(" + name + ".scalar_type())";
    const std::string condition = text("  if (wanted & ", int64_t{1} << outputs.size(), ") ");
    made += condition + "results.push_back(at::empty" + size + options + "));\n";
    alone += condition + "{\n" + variable +
             "    succeed(backward_name, RETROGRADE_TORCH_GRADIENT(_" + by + ")(" +
             values["values"] + ", " + values["seeds"] + ", " + by + "));\n    results.push_back(" +
             result + ");\n  }\n";
    variables.push_back(variable);
    outputs.push_back(by);
    results.push_back(result);
  }
  values.insert({{"gradient_count", text(outputs.size())},
                 {"gradients_made", made},
                 {"gradients_alone", outputs.size() > 1 ? alone : ""},
                 {"gradient_variables", joined(variables, "")},
                 {"gradient_outputs", joined(outputs)},
                 {"gradient_results", joined(results)}});
}

// Adds the values that autograd saves during a call, and the gradient that it returns for each argument.
void add_backward_pass(const TorchFunction& function, TextValues& values) {
  std::vector<std::string> restored, gradients;
  std::string save_numbers, find_wanted;
  size_t tensors = 0, bits = 0;
  for (const ExportArgument& input : function.inputs) {
    const std::string name = name_of(input);
    if (!is_tensor(input)) {
      save_numbers += "    context->saved_data[\"" + name + "\"] = " + name + ";\n";
      restored.push_back("context->saved_data[\"" + name + "\"]." +
                         (input.type.is_bool() ? "toBool()" : "toInt()"));
      gradients.push_back("at::Tensor()");
      continue;
    }
    if (is_differentiable(input)) {
      const int64_t bit = int64_t{1} << bits++;
      find_wanted +=
          text("    if (context->needs_input_grad(", tensors, ")) wanted |= ", bit, ";\n");
      gradients.push_back(text("gradient(", bit, ")"));
    } else {
      gradients.push_back("at::Tensor()");
    }
    restored.push_back(text("saved[", tensors++, "]"));
  }
  values.insert({{"save_numbers", save_numbers},
                 {"find_wanted", find_wanted},
                 {"restored", joined(restored)},
                 {"autograd_results", joined(gradients)}});
}

}  // namespace

std::string torch_operator_text(const TorchFunction& function) {
  TextValues values;
  add_results(function, values);
  add_arguments(function, values);
  add_seeds(function, values);
  add_gradients(function, values);
  add_backward_pass(function, values);
  return filled(pytorch_operator_text, values);
}

}  // namespace retrograde::aot
