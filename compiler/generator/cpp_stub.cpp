// cpp_stub.cpp -- writes the stub header, with the declarations of a generator as C++ text.
#include "generator/cpp_stub.h"

#include <set>
#include <sstream>

#include "frontend/run/compiler_interface.h"

namespace retrograde::internal {

namespace {

// A member of one of the structs, and how its value is converted to that of a parameter.
struct Member {
  std::string type, name, value;  // value: its default, empty for none
  std::string key, text;          // its name in the generator; of a param: the text of its value
};

// Unique names for the members of a struct; a duplicate gets an underscore.
class MemberNames {
 public:
  explicit MemberNames(std::set<std::string> taken) : taken_(std::move(taken)) {}
  std::string operator()(std::string name) {
    while (!taken_.insert(name).second) name += "_";
    return name;
  }

 private:
  std::set<std::string> taken_;
};

// "a::b::C" => {"a", "b", "C"}
std::vector<std::string> split_at_colons(std::string name) {
  std::vector<std::string> parts;
  for (size_t colons; (colons = name.find("::")) != std::string::npos;) {
    parts.push_back(name.substr(0, colons));
    name = name.substr(colons + 2);
  }
  parts.push_back(name);
  return parts;
}

std::string joined(const std::vector<std::string>& parts, const std::string& separator) {
  std::string out;
  for (const std::string& part : parts) out += (out.empty() ? "" : separator) + part;
  return out;
}

std::string element_type(const GeneratorPort& io, const char* buffer_class) {
  switch (io.kind()) {
    case IOKind::Scalar:
      return io.role_name() == "input" ? "::retrograde::Expr" : "::retrograde::Func";
    case IOKind::Function:
      return "::retrograde::Func";
    case IOKind::Buffer:
      break;
  }
  const bool is_known = io.types_defined() && io.types().size() == 1;
  return text("::retrograde::internal::", buffer_class, "<",
              is_known ? cpp_element_name(io.types()[0]) : "", ">");
}

Member member_of(const GeneratorPort& io, const char* buffer_class, MemberNames& names) {
  const std::string element = element_type(io, buffer_class);
  return {io.is_array() ? "std::vector<" + element + ">" : element, names(io.name()), "", io.name(),
          ""};
}

// Adds a member out_type for each parameter "out.type" that an output's declaration leaves open.
void add_open_parts(const GeneratorPort& output, std::vector<Member>& params, MemberNames& names) {
  const auto add = [&](const char* type, const std::string& part, const char* value,
                       const char* function) {
    const std::string name = names(output.name() + "_" + part);
    params.push_back(
        {type, name, value, output.name() + "." + part, std::string(function) + "(" + name + ")"});
  };
  if (!output.types_defined())
    add("::retrograde::Type", "type", "::retrograde::Type()", "::retrograde::to_string");
  if (!output.dims_defined()) add("int", "dim", "-1", "::retrograde::internal::param_text");
  if (!output.array_size_defined()) add("int", "size", "-1", "::retrograde::internal::param_text");
}

class StubWriter {
 public:
  StubWriter(std::string generator, const std::string& class_name)
      : generator_(std::move(generator)), path_(split_at_colons(class_name)) {}

  void add(const GeneratorParamBase& param) {
    const GeneratorParamBase::InCpp cpp = param.in_cpp();
    if (!cpp.choices.empty()) return add_enumeration(param.name(), cpp);
    if (cpp.type.empty()) return;
    const std::string name = param_names_(param.name());
    const std::string text = *cpp.to_text ? std::string(cpp.to_text) + "(" + name + ")" : name;
    params_.push_back({cpp.type, name, cpp.value, param.name(), text});
  }
  void add(const GeneratorInputBase& input) {
    inputs_.push_back(member_of(input, "StubInputBuffer", input_names_));
  }
  void add(const GeneratorOutputBase& output) {
    add_open_parts(output, params_, param_names_);
    outputs_.push_back(member_of(output, "StubOutputBuffer", output_names_));
    is_array_output_.push_back(output.is_array());
  }

  std::string text() {
    const std::string guard = "RETROGRADE_STUB_" + joined(path_, "_");
    const std::vector<std::string> namespaces(path_.begin(), path_.end() - 1);
    out_ << "// Runs the generator " << quoted(generator_) << ". Made by it; not to be edited.\n"
         << "#ifndef " << guard << "\n#define " << guard << "\n\n"
         << "#include <retrograde/retrograde.h>\n\n#include \"generator/cpp_stub.h\"\n\n";
    for (const std::string& name : namespaces) out_ << "namespace " << name << " {\n";
    out_ << "\n" << enumerations_.str() << "struct " << path_.back() << " {\n";
    write_struct("Inputs", inputs_, constructors("Inputs", inputs_));
    write_struct("GeneratorParams", params_,
                 constructors("GeneratorParams", params_) + map_of_params());
    write_struct("Outputs", outputs_with_target(), pipeline_of_outputs());
    write_generate();
    out_ << "};\n\n";
    for (size_t i = 0; i < namespaces.size(); i++) out_ << "}\n";
    out_ << "#endif\n";
    return out_.str();
  }

 private:
  const std::string generator_;
  const std::vector<std::string> path_;
  std::vector<Member> inputs_, params_, outputs_;
  MemberNames input_names_{{"Inputs"}};
  MemberNames param_names_{{"GeneratorParams", "to_generator_params_map"}};
  MemberNames output_names_{{"Outputs", "target", "get_pipeline", "realize"}};
  std::vector<bool> is_array_output_;
  std::ostringstream enumerations_, out_;

  void add_enumeration(const std::string& name, const GeneratorParamBase::InCpp& cpp) {
    const std::string type = "Enum_" + name;
    enumerations_ << "enum class " << type << " { " << joined(cpp.choices, ", ") << " };\n"
                  << "inline const char* param_text(" << type << " value) {\n"
                  << "  const char* const names[] = {\"" << joined(cpp.choices, "\", \"")
                  << "\"};\n  return names[static_cast<int>(value)];\n}\n\n";
    const std::string member = param_names_(name);
    params_.push_back({type, member, type + "::" + cpp.value, name, "param_text(" + member + ")"});
  }

  // Two constructors: one that takes all members, and one without arguments.
  static std::string constructors(const std::string& name, const std::vector<Member>& members) {
    const std::string plain = "    " + name + "() {}\n";
    if (members.empty()) return plain;
    std::vector<std::string> parameters, initializers;
    for (const Member& member : members) {
      parameters.push_back("const " + member.type + "& " + member.name + "_");
      initializers.push_back(member.name + "(" + member.name + "_)");
    }
    return plain + "    " + name + "(" + joined(parameters, ", ") +
           ")\n        : " + joined(initializers, ", ") + " {}\n";
  }

  void write_struct(const std::string& name, const std::vector<Member>& members,
                    const std::string& more) {
    out_ << "  struct " << name << " {\n";
    for (const Member& member : members) {
      out_ << "    " << member.type << " " << member.name;
      if (!member.value.empty()) out_ << " = " << member.value;
      out_ << ";\n";
    }
    out_ << more << "  };\n\n";
  }

  std::string map_of_params() const {
    std::string body =
        "    ::retrograde::internal::GeneratorParamsMap to_generator_params_map() "
        "const {\n      ::retrograde::internal::GeneratorParamsMap map;\n";
    for (const Member& param : params_) {
      const bool is_open = param.key.find('.') != std::string::npos;
      const std::string set = "map.insert_or_assign(\"" + param.key + "\", " + param.text + ");\n";
      const std::string test =
          param.value == "-1" ? param.name + " >= 0" : param.name + ".bits() > 0";
      body += is_open ? "      if (" + test + ") " + set : "      " + set;
    }
    return body + "      return map;\n    }\n";
  }

  std::vector<Member> outputs_with_target() const {
    std::vector<Member> members = outputs_;
    members.push_back({"::retrograde::Target", "target", "", "", ""});
    return members;
  }

  std::string pipeline_of_outputs() const {
    std::string body =
        "    ::retrograde::Pipeline get_pipeline() const {\n"
        "      std::vector<::retrograde::Func> all;\n";
    for (size_t i = 0; i < outputs_.size(); i++) {
      const std::string& name = outputs_[i].name;
      body += is_array_output_[i]
                  ? "      all.insert(all.end(), " + name + ".begin(), " + name + ".end());\n"
                  : "      all.push_back(" + name + ");\n";
    }
    std::string as_func;
    if (outputs_.size() == 1 && !is_array_output_[0])
      as_func = "    operator ::retrograde::Func() const { return " + outputs_[0].name + "; }\n";
    return as_func + body +
           "      return ::retrograde::Pipeline(all);\n    }\n"
           "    ::retrograde::Realization realize(const std::vector<int32_t>& sizes) const {\n"
           "      return get_pipeline().realize(sizes, target);\n    }\n"
           "    template <typename... Args>\n"
           "    void realize(Args&&... args) const {\n"
           "      get_pipeline().realize(std::forward<Args>(args)..., target);\n    }\n";
  }

  void write_generate() {
    std::vector<std::string> inputs, outputs;
    for (const Member& input : inputs_) inputs.push_back("inputs." + input.name);
    for (size_t i = 0; i < outputs_.size(); i++) {
      const std::string funcs = "generator->output_funcs(\"" + outputs_[i].key + "\")";
      if (!is_array_output_[i])
        outputs.push_back(funcs + ".at(0)");
      else
        outputs.push_back("::retrograde::internal::StubOutputs{" + funcs + "}");
    }
    outputs.push_back("generator->get_target()");
    out_
        << "  static Outputs generate(const ::retrograde::GeneratorContext& context, const Inputs& "
           "inputs,\n                          const GeneratorParams& params = {}) {\n"
        << "    auto generator = ::retrograde::internal::GeneratorRegistry::create(\"" << generator_
        << "\", context);\n"
        << "    generator->set_generator_param_values(params.to_generator_params_map());\n"
        << "    generator->set_inputs(" << joined(inputs, ", ") << ");\n"
        << "    generator->schedule_all();\n"
        << "    return {" << joined(outputs, ",\n            ") << "};\n  }\n"
        << "  static Outputs generate(const ::retrograde::internal::GeneratorBase* caller,\n"
        << "                          const Inputs& inputs, const GeneratorParams& params = {}) {\n"
        << "    return generate(caller->context(), inputs, params);\n  }\n"
        << "  static Outputs generate(const ::retrograde::Target& target, const Inputs& inputs,\n"
        << "                          const GeneratorParams& params = {}) {\n"
        << "    return generate(::retrograde::GeneratorContext(target), inputs, params);\n  }\n";
  }
};

}  // namespace

bool GeneratorBase::emit_cpp_stub(const std::string& path) {
  configure_once();
  StubWriter writer(name_, stub_name_.empty() ? name_ : stub_name_);
  for (const GeneratorParamBase* param : members_.params) writer.add(*param);
  for (const GeneratorInputBase* input : members_.inputs) writer.add(*input);
  for (const GeneratorOutputBase* output : members_.outputs) writer.add(*output);
  default_compiler().write_text(path, writer.text());
  return true;
}

}  // namespace retrograde::internal
