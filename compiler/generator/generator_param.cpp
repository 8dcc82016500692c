// generator_param.cpp -- converts values of generator parameters from and to text.
#include "generator/generator_param.h"

#include <array>

#include "generator/generator_base.h"
#include "generator/members.h"

namespace retrograde::internal {

GeneratorParamBase::GeneratorParamBase(const std::string& name) : name_(name) {
  if (GeneratorMembers* members = GeneratorMembers::around(this)) members->params.push_back(this);
}

bool GeneratorParamBase::is_writable() const {
  const GeneratorMembers* members = GeneratorMembers::around(this);
  return !members || !members->owner()->is_generated();
}

void GeneratorParamBase::check_writable() const {
  if (is_writable()) return;
  user_error("set the GeneratorParam " + quoted(name_), "a value is set before generate() reads it",
             "generate() has run", "Set it before apply() or build_module()");
}

void GeneratorParamBase::refuse(const std::string& value, const std::string& rule,
                                const std::string& evidence, const std::string& instead) const {
  user_error("set the GeneratorParam " + quoted(name_) + " to " + quoted(value), rule, evidence,
             instead);
}

void GeneratorParamBase::set_from_loop_level(const LoopLevel& level) {
  refuse(level.to_string(), "a param takes values of its type", "a LoopLevel was given",
         "Give a value of its type");
}

std::string cpp_literal(const std::string& text) {
  std::string literal = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      literal += std::string("\\") + c;
    else
      literal += c == '\n' ? "\\n" : std::string(1, c);
  }
  return literal + "\"";
}

std::string cpp_type(const Type& type) {
  if (type.is_bool()) return "::retrograde::Bool()";
  if (type.is_handle()) return "::retrograde::Handle()";
  const char* names[] = {"Int", "UInt", "Float", "BFloat"};
  return text("::retrograde::", names[static_cast<int>(type.code())], "(", type.bits(), ")");
}

std::string cpp_element_name(const Type& type) {
  if (type.is_bool()) return "bool";
  if (type.is_handle()) return "void*";
  if (type.is_bfloat()) return "::retrograde::bfloat16_t";
  if (type.is_float())
    return type.bits() == 16 ? "::retrograde::float16_t" : type.bits() == 32 ? "float" : "double";
  return to_string(type) + "_t";
}

std::optional<bool> read_bool(const std::string& text) {
  if (text == "true" || text == "True") return true;
  if (text == "false" || text == "False") return false;
  return std::nullopt;
}

namespace {
constexpr std::array param_types = {Bool(),     Int(8),    Int(16),   Int(32),  Int(64),
                                    UInt(8),    UInt(16),  UInt(32),  UInt(64), Float(16),
                                    BFloat(16), Float(32), Float(64), Handle()};
}  // namespace

std::optional<Type> read_type(const std::string& text) {
  for (const Type& type : param_types) {
    if (to_string(type) == text) return type;
  }
  return std::nullopt;
}

std::string type_choices() {
  return listed(param_types, [](const Type& type) { return to_string(type); });
}

std::optional<LoopLevel> read_loop_level(const std::string& text) {
  if (text == "root") return LoopLevel::root();
  if (text == "inlined") return LoopLevel::inlined();
  return std::nullopt;
}

}  // namespace retrograde::internal
