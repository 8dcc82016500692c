// pytorch_wrapper.cpp -- see pytorch_wrapper.h. What depends on the function's arguments is put together here, into
// texts that do not.
#include "aot/pytorch_wrapper.h"

#include <cctype>
#include <functional>
#include <map>

#include "aot/mangle.h"
#include "aot/pytorch_text.h"
#include "diagnostics/error.h"
#include "ir/print.h"

namespace retrograde::aot {
namespace {

using codegen::ExportArgument;
using Kind = ExportArgument::Kind;
using Values = std::map<std::string, std::string>;

std::string word(const std::string& name) {
  std::string result;
  for (char c : name) result += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return result;
}

// "$name$" in a text stands for a value.
std::string filled(std::string text, const Values& values) {
  for (const auto& [name, value] : values) {
    const std::string place = "$" + name + "$";
    for (size_t at = text.find(place); at != std::string::npos;
         at = text.find(place, at + value.size()))
      text.replace(at, place.size(), value);
  }
  return text;
}

// The tensors' name of an element type.
std::string scalar_type(const ExportArgument& argument) {
  const Type type = argument.type;
  const std::string bits = std::to_string(type.bits());
  if (type.is_bool()) return "at::kBool";
  if (type.is_bfloat()) return "at::kBFloat16";
  if (type.is_float())
    return type.bits() == 16 ? "at::kHalf" : type.bits() == 32 ? "at::kFloat" : "at::kDouble";
  if (type.is_int())
    return type.bits() == 8    ? "at::kChar"
           : type.bits() == 16 ? "at::kShort"
           : type.bits() == 32 ? "at::kInt"
                               : "at::kLong";
  if (type.is_uint() && type.bits() == 8) return "at::kByte";
  unsupported("write a wrapper for PyTorch",
              "what PyTorch calls has tensors and numbers that PyTorch has",
              quoted(argument.name) + " holds " + to_string(type), "Use another element type");
}

std::string element_type(const ExportArgument& argument) {
  const Type type = argument.type;
  const char* const code = type.is_bfloat()  ? "halide_type_bfloat"
                           : type.is_float() ? "halide_type_float"
                           : type.is_int()   ? "halide_type_int"
                                             : "halide_type_uint";
  return text("halide_type_t(", code, ", ", type.bits(), ")");
}

std::string number_type(const ExportArgument& argument) {
  return argument.type.is_bool() ? "bool" : argument.type.is_float() ? "double" : "int64_t";
}

std::string schema_type(const ExportArgument& argument) {
  if (argument.is_buffer()) return "Tensor";
  return argument.type.is_bool() ? "bool" : argument.type.is_float() ? "float" : "int";
}

// ---- the function ----

struct Function {
  std::string name;  // as C++ calls it
  bool user_context = false;
  std::vector<ExportArgument> inputs, outputs, images;  // images: those of the inputs
};

Function function_of(const DeclaredFunction& declared) {
  Function function{declared.name, declared.signature.user_context, {}, {}, {}};
  if (name_parts(declared.name).size() > 1) {
    unsupported("write a wrapper for PyTorch of " + quoted(declared.name),
                "what PyTorch calls has a name of C", "it is in a namespace",
                "Leave the namespace out");
  }
  for (const ExportArgument& argument : declared.signature.arguments) {
    if (argument.name == "__user_context") continue;
    scalar_type(argument);
    (argument.kind == Kind::OutputBuffer ? function.outputs : function.inputs).push_back(argument);
    if (argument.kind == Kind::InputBuffer) function.images.push_back(argument);
  }
  return function;
}

std::string listed(const std::vector<ExportArgument>& arguments,
                   const std::function<std::string(const ExportArgument&)>& each) {
  std::string result;
  for (const ExportArgument& argument : arguments)
    result += (result.empty() ? "" : ", ") + each(argument);
  return result;
}

std::string parameter(const ExportArgument& argument) {
  return (argument.is_buffer() ? "const at::Tensor& " : number_type(argument) + " ") +
         word(argument.name);
}

std::string wrapper(const Function& function) {
  std::string views, call = function.user_context ? "nullptr" : "", parameters;
  const auto add = [&](const ExportArgument& argument) {
    const std::string name = word(argument.name);
    const bool is_output = argument.kind == Kind::OutputBuffer;
    parameters += (parameters.empty() ? "" : ", ") +
                  (is_output ? "at::Tensor& " + name : parameter(argument));
    call += call.empty() ? "" : ", ";
    if (!argument.is_buffer()) {
      call += "static_cast<" + c_type(argument) + ">(" + name + ")";
      return;
    }
    views +=
        text("  retrograde_torch::View<", argument.dimensions, "> view_of_", name, "(\"",
             function.name, "\", \"", argument.name, "\", ", name, ", ", element_type(argument),
             ", ", scalar_type(argument), ", ", is_output ? "true" : "false", ");\n");
    call += "&view_of_" + name + ".raw";
  };
  for (const ExportArgument& argument : function.inputs) add(argument);
  for (const ExportArgument& argument : function.outputs) add(argument);
  return filled(
      R"(
// The function's code: 0, or that of an error. c10::Error for tensors that it cannot take.
inline int $name$_th_($parameters$) {
$views$  return ::$name$($call$);
}
)",
      {{"name", function.name}, {"parameters", parameters}, {"views", views}, {"call", call}});
}

// ---- the operator ----

std::string shape_function(const Function& function, const ExportArgument& output) {
  const ExportArgument* like = nullptr;
  for (const ExportArgument& image : function.images)
    if (!like && image.dimensions == output.dimensions) like = &image;
  std::string ranks;
  for (const ExportArgument& image : function.images) {
    ranks += text("  retrograde_torch::check_rank(\"", function.name, "\", \"", image.name, "\", ",
                  word(image.name), ", ", image.dimensions, ");\n");
  }
  const std::string otherwise =
      like ? "  const auto sizes = " + word(like->name) +
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
                {{"output", word(output.name)},
                 {"parameters", listed(function.inputs, parameter)},
                 {"ranks", ranks},
                 {"otherwise", otherwise}});
}

std::string results_type(size_t count) {
  if (count == 1) return "at::Tensor";
  std::string types;
  for (size_t i = 0; i < count; i++) types += i ? ", at::Tensor" : "at::Tensor";
  return "std::tuple<" + types + ">";
}

std::string results_schema(size_t count) {
  if (count == 1) return "Tensor";
  std::string types;
  for (size_t i = 0; i < count; i++) types += i ? ", Tensor" : "Tensor";
  return "(" + types + ")";
}

std::string joined(const std::vector<std::string>& parts, const std::string& between = ", ") {
  std::string result;
  for (const std::string& part : parts) result += (result.empty() ? "" : between) + part;
  return result;
}

std::string operator_section(const Function& function) {
  const auto name = [](const ExportArgument& argument) { return word(argument.name); };
  const std::string arguments = listed(function.inputs, name);
  const std::string options = word(function.images[0].name) + ".options()";
  std::vector<std::string> empties, variables, outputs, seeds, seed_parameters, seed_types,
      seed_schema, seed_list, apply_results;
  for (size_t i = 0; i < function.outputs.size(); i++) {
    const ExportArgument& output = function.outputs[i];
    const std::string empty = "at::empty_symint(shape_of_" + word(output.name) + "(" + arguments +
                              "), " + options + ".dtype(" + scalar_type(output) + "))";
    empties.push_back(empty);
    variables.push_back("  at::Tensor made_" + word(output.name) + " = " + empty + ";\n");
    outputs.push_back("made_" + word(output.name));
    seeds.push_back("seed_" + word(output.name));
    seed_parameters.push_back("const at::Tensor& seed_" + word(output.name));
    seed_types.push_back("const at::Tensor&");
    seed_schema.push_back("Tensor seed_" + word(output.name));
    seed_list.push_back(text("seeds[", i, "].contiguous()"));
    apply_results.push_back(text("results[", i, "]"));
  }
  // Results of the gradient's function: one for each pair of output and image, outputs first.
  std::vector<std::string> gradient_empties, gradient_variables, gradient_outputs, gradient_sums,
      requires_grad, only_once, images;
  for (size_t k = 0; k < function.images.size(); k++) {
    const std::string image = word(function.images[k].name);
    images.push_back(image);
    gradient_empties.push_back("at::empty_symint(" + image + ".sym_sizes(), " + image +
                               ".options())");
    requires_grad.push_back(image + ".requires_grad()");
    only_once.push_back(text("results[", k, "]"));
    std::vector<std::string> parts;
    for (const ExportArgument& output : function.outputs)
      parts.push_back("by_" + image + "_of_" + word(output.name));
    gradient_sums.push_back(joined(parts, " + "));
  }
  for (const ExportArgument& output : function.outputs) {
    for (size_t k = 0; k < function.images.size(); k++) {
      const std::string variable = "by_" + images[k] + "_of_" + word(output.name);
      gradient_variables.push_back("  at::Tensor " + variable + " = " + gradient_empties[k] +
                                   ";\n");
      gradient_outputs.push_back(variable);
    }
  }
  std::vector<std::string> restored, autograd_results;
  std::string save_numbers;
  size_t next_image = 0;
  for (const ExportArgument& input : function.inputs) {
    const std::string argument = word(input.name);
    if (input.is_buffer()) {
      restored.push_back(text("saved[", next_image, "]"));
      autograd_results.push_back(input.type.is_float() ? text("results[", next_image, "]")
                                                       : "at::Tensor()");
      next_image++;
      continue;
    }
    save_numbers += "    context->saved_data[\"" + argument + "\"] = " + argument + ";\n";
    const char* const get = input.type.is_bool()    ? "toBool"
                            : input.type.is_float() ? "toDouble"
                                                    : "toInt";
    restored.push_back("context->saved_data[\"" + argument + "\"]." + get + "()");
    autograd_results.push_back("at::Tensor()");
  }
  std::string shapes;
  for (const ExportArgument& output : function.outputs) shapes += shape_function(function, output);
  const std::string parameters = listed(function.inputs, parameter);
  const std::string types = listed(function.inputs, [](const ExportArgument& argument) {
    return argument.is_buffer() ? "const at::Tensor&" : number_type(argument);
  });
  const std::string schema = listed(function.inputs, [](const ExportArgument& argument) {
    return schema_type(argument) + " " + word(argument.name);
  });
  std::vector<std::string> any_seed;
  for (const std::string& seed : seeds) any_seed.push_back(seed + ".requires_grad()");
  const size_t results = function.outputs.size(), gradients = function.images.size();
  return filled(pytorch_operator_text,
                {{"results", results_type(results)},
                 {"results_schema", results_schema(results)},
                 {"gradients", results_type(gradients)},
                 {"gradients_schema", results_schema(gradients)},
                 {"shapes", shapes},
                 {"function", function.name},
                 {"parameters", parameters},
                 {"types", types},
                 {"schema", schema},
                 {"arguments", arguments},
                 {"images", joined(images)},
                 {"empties", joined(empties)},
                 {"empty_variables", joined(variables, "")},
                 {"outputs", joined(outputs)},
                 {"any_requires_grad", joined(requires_grad, " || ")},
                 {"any_seed_requires_grad", joined(any_seed, " || ")},
                 {"seeds", joined(seeds)},
                 {"seed_schema", joined(seed_schema)},
                 {"seed_list", joined(seed_list)},
                 {"backward_parameters", parameters + ", " + joined(seed_parameters)},
                 {"backward_types", types + ", " + joined(seed_types)},
                 {"gradient_empties", joined(gradient_empties)},
                 {"gradient_variables", joined(gradient_variables, "")},
                 {"gradient_outputs", joined(gradient_outputs)},
                 {"gradient_sums", joined(gradient_sums)},
                 {"results_of_only_once", results_type(gradients) + "(" + joined(only_once) + ")"},
                 {"results_of_apply", results_type(results) + "(" + joined(apply_results) + ")"},
                 {"save_numbers", save_numbers},
                 {"restored", joined(restored)},
                 {"autograd_results", joined(autograd_results)}});
}

}  // namespace

std::string pytorch_wrapper_text(const std::string& module_name,
                                 const std::vector<DeclaredFunction>& functions) {
  const std::string guard = "RETROGRADE_PYTORCH_" + word(module_name) + "_H";
  std::string result =
      "// " + module_name +
      ": its functions on tensors of PyTorch, and their registration as an operator.\n#ifndef " +
      guard + "\n#define " + guard +
      "\n\n#include <ATen/ATen.h>\n#include <HalideRuntime.h>\n\n#include <stdexcept>\n"
      "#include <string>\n#include <tuple>\n#include <vector>\n\n#include \"" +
      word(module_name) + ".h\"\n" + pytorch_helpers;
  for (const DeclaredFunction& declared : functions) {
    const Function function = function_of(declared);
    result += wrapper(function);
    if (!function.images.empty()) result += operator_section(function);
  }
  return result + "\n#endif\n";
}

}  // namespace retrograde::aot
