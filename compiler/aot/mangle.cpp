// C++ symbols by the Itanium C++ ABI, section 5.1: a nested name, then the parameter types. Anything that occurred
// before is abbreviated by a substitution (S_, S0_, S1_ ...).
#include "aot/mangle.h"

#include <algorithm>

#include "diagnostics/error.h"

namespace retrograde::aot {
namespace {

class Mangler {
 public:
  explicit Mangler(const std::string& name) {
    const std::vector<std::string> parts = name_parts(name);
    if (parts.size() == 1) {
      text = "_Z" + source_name(parts[0]);
      return;
    }
    text = "_ZN";
    std::string prefix;
    for (const std::string& part : parts) {
      text += source_name(part);
      prefix += "::" + part;
      if (&part != &parts.back()) seen_.push_back(prefix);
    }
    text += "E";
  }

  // `layers`: pointer, const or a struct's name, outermost first: {"P", "15halide_buffer_t"}.
  void add_compound(const std::vector<std::string>& layers) {
    std::string key;
    std::vector<std::string> keys(layers.size());
    for (size_t i = layers.size(); i-- > 0;) keys[i] = key = layers[i] + key;
    size_t i = 0;
    while (i < layers.size() && !refer(keys[i])) text += layers[i++];
    // Inner types come first in the substitution table.
    for (size_t j = i; j-- > 0;) {
      const bool is_builtin = j + 1 == layers.size() && layers[j].size() == 1;
      if (!is_builtin) seen_.push_back(keys[j]);
    }
  }
  void add(char builtin) { text += builtin; }

  std::string text;

 private:
  std::vector<std::string> seen_;

  static std::string source_name(const std::string& name) {
    return std::to_string(name.size()) + name;
  }

  bool refer(const std::string& key) {
    const auto found = std::find(seen_.begin(), seen_.end(), key);
    if (found == seen_.end()) return false;
    const auto index = found - seen_.begin();
    RETROGRADE_ASSERT(index <= 10, "too many parts in a mangled name");
    text += index == 0 ? std::string("S_") : "S" + std::to_string(index - 1) + "_";
    return true;
  }
};

char builtin(Type type) {
  if (type.is_bool()) return 'b';
  if (type.is_float() && type.bits() == 64) return 'd';
  if (type.is_float() && type.bits() == 32) return 'f';
  const std::string codes = type.is_int() ? "asil" : "htjm";
  return codes[type.bits() == 8 ? 0 : type.bits() == 16 ? 1 : type.bits() == 32 ? 2 : 3];
}

}  // namespace

std::vector<std::string> name_parts(const std::string& name) {
  std::vector<std::string> parts;
  size_t begin = 0;
  for (size_t end; (end = name.find("::", begin)) != std::string::npos; begin = end + 2)
    parts.push_back(name.substr(begin, end - begin));
  parts.push_back(name.substr(begin));
  return parts;
}

std::string c_type(const codegen::ExportArgument& argument) {
  const Type type = argument.type;
  if (argument.is_buffer()) return "struct halide_buffer_t *";
  if (type.is_handle()) return argument.name == "__user_context" ? "void const *" : "void *";
  if (type.is_bool()) return "bool";
  if (type.is_float() && type.bits() == 64) return "double";
  if (type.is_float() && type.bits() == 32) return "float";
  // 16-bit floats are passed as their bits.
  return std::string(type.is_int() ? "int" : "uint") + std::to_string(type.bits()) + "_t";
}

std::string mangled(const std::string& name,
                    const std::vector<codegen::ExportArgument>& arguments) {
  Mangler mangler(name);
  for (const codegen::ExportArgument& argument : arguments) {
    if (argument.is_buffer()) {
      mangler.add_compound({"P", "15halide_buffer_t"});
    } else if (argument.type.is_handle()) {
      argument.name == "__user_context" ? mangler.add_compound({"P", "K", "v"})
                                        : mangler.add_compound({"P", "v"});
    } else {
      mangler.add(builtin(argument.type));
    }
  }
  return mangler.text;
}

std::string mangled_argv(const std::string& name) {
  Mangler mangler(name);
  mangler.add_compound({"P", "P", "v"});
  return mangler.text;
}

std::string mangled_metadata(const std::string& name) {
  Mangler mangler(name);
  mangler.add('v');
  return mangler.text;
}

}  // namespace retrograde::aot
