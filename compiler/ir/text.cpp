// Keywords, type names and operators of IR text, shared by the printer and the parser.
#include "ir/text.h"

#include <algorithm>
#include <cctype>
#include <unordered_set>

namespace retrograde::ir {

const char* for_name(ForType type) {
  static constexpr const char* names[] = {"serial",    "parallel",   "vectorized", "unrolled",
                                          "gpu_block", "gpu_thread", "gpu_lane"};
  return names[static_cast<int>(type)];
}

const char* partition_name(Partition partition) {
  static constexpr const char* names[] = {"auto_partition", "never_partition", "always_partition"};
  return names[static_cast<int>(partition)];
}

const char* memory_name(MemoryType memory) {
  static constexpr const char* names[] = {"auto",         "heap",       "stack",
                                          "register",     "gpu_shared", "gpu_texture",
                                          "locked_cache", "vtcm",       "amx_tile"};
  return names[static_cast<int>(memory)];
}

std::string kind_word(Kind op) {
  std::string name = kind_name(op);
  name[0] = static_cast<char>(std::tolower(name[0]));
  return name;
}

namespace {

// Precedences are C's; sum_precedence is that of + and -.
constexpr InfixOperator infix_operators[] = {
    {Kind::Or, "||", 0}, {Kind::And, "&&", 1}, {Kind::EQ, "==", 2}, {Kind::NE, "!=", 2},
    {Kind::LT, "<", 3},  {Kind::LE, "<=", 3},  {Kind::GT, ">", 3},  {Kind::GE, ">=", 3},
    {Kind::Add, "+", 4}, {Kind::Sub, "-", 4},  {Kind::Mul, "*", 5}, {Kind::Div, "/", 5},
    {Kind::Mod, "%", 5}};

template <class Holds>
const InfixOperator* find_infix(Holds holds) {
  const auto* found = std::ranges::find_if(infix_operators, holds);
  return found == std::end(infix_operators) ? nullptr : found;
}

}  // namespace

const InfixOperator* infix_operator(Kind kind) {
  return find_infix([&](const InfixOperator& op) { return op.kind == kind; });
}
const InfixOperator* infix_operator(const std::string& symbol) {
  return find_infix([&](const InfixOperator& op) { return op.symbol == symbol; });
}

bool read_type(const std::string& word, Type& type) {
  size_t at = 0;
  const auto number = [&](int& value) {
    const size_t start = at;
    for (value = 0;
         at < word.size() && at < start + 5 && std::isdigit(static_cast<unsigned char>(word[at]));
         ++at) {
      value = 10 * value + (word[at] - '0');
    }
    return at > start;
  };
  const auto starts = [&](const char* prefix) {
    if (word.rfind(prefix, 0) != 0) return false;
    at = std::string(prefix).size();
    return true;
  };
  int bits = 0, lanes = 1;
  TypeCode code;
  if (starts("bool")) {
    code = TypeCode::UInt, bits = 1;
  } else if (starts("handle")) {
    code = TypeCode::Handle, bits = 64;
  } else {
    if (starts("int"))
      code = TypeCode::Int;
    else if (starts("uint"))
      code = TypeCode::UInt;
    else if (starts("float"))
      code = TypeCode::Float;
    else if (starts("bfloat"))
      code = TypeCode::BFloat;
    else
      return false;
    if (!number(bits)) return false;
    const bool is_float = code == TypeCode::Float || code == TypeCode::BFloat;
    if (bits != 16 && bits != 32 && bits != 64 && (is_float || bits != 8)) return false;
  }
  if (at < word.size() && (word[at++] != 'x' || !number(lanes) || lanes < 2 || lanes > 65535))
    return false;
  if (at != word.size()) return false;
  type = Type(code, bits, lanes);
  return true;
}

bool is_reserved(const std::string& word) {
  static const std::unordered_set<std::string> keywords = {"true",
                                                           "false",
                                                           "min",
                                                           "max",
                                                           "select",
                                                           "reinterpret",
                                                           "ramp",
                                                           "broadcast",
                                                           "shuffle",
                                                           "reduce",
                                                           "image",
                                                           "extern",
                                                           "let",
                                                           "if",
                                                           "else",
                                                           "assert",
                                                           "free",
                                                           "evaluate",
                                                           "produce",
                                                           "consume",
                                                           "for",
                                                           "serial",
                                                           "parallel",
                                                           "vectorized",
                                                           "unrolled",
                                                           "realize",
                                                           "allocate",
                                                           "atomic",
                                                           "fork",
                                                           "prefetch",
                                                           "and",
                                                           "never_partition",
                                                           "always_partition"};
  Type type;
  return keywords.count(word) || op_from_name(word) != Op::none || read_type(word, type) ||
         word.rfind("nan_", 0) == 0 || word.rfind("inf_", 0) == 0;
}

std::string quote_name(const std::string& name) {
  const auto is_name_char = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.' || c == '$';
  };
  bool plain = !name.empty() && !std::isdigit(static_cast<unsigned char>(name[0])) &&
               name[0] != '.' && name.back() != '.' && !is_reserved(name);
  for (char c : name) plain &= is_name_char(c);
  if (plain) return name;
  std::string quoted = "`";
  for (char c : name) quoted += c == '`' ? std::string("``") : std::string(1, c);
  return quoted + '`';
}

std::string NameTypes::key(NameUse use, const std::string& name, int component) {
  return static_cast<char>(use) + name + (component ? '.' + std::to_string(component) : "");
}

const Type* NameTypes::find(const std::string& key) const {
  const auto known = types_.find(key);
  if (known != types_.end()) return &known->second;
  return outer_ ? outer_->find(key) : nullptr;
}

void NameTypes::declare(NameUse use, const std::string& name, Type type, int component) {
  types_[key(use, name, component)] = type;
}

Type NameTypes::implied(NameUse use, const std::string& name, int lanes, int component) const {
  const Type* known = find(key(use, name, component));
  const Type type = known ? *known : Int(32);
  return use == NameUse::Variable ? type : type.with_lanes(lanes);
}

void NameTypes::mention(NameUse use, const std::string& name, Type type, int component) {
  const std::string mentioned = key(use, name, component);
  if (!find(mentioned)) types_.emplace(mentioned, type);
}

void NameTypes::declare_components(const std::string& func, const std::vector<Type>& types) {
  for (size_t i = 0; i < types.size(); ++i)
    declare(NameUse::Call, func, types[i], static_cast<int>(i));
}

void NameTypes::mention_components(const std::string& func, const std::vector<Expr>& values) {
  for (size_t i = 0; i < values.size(); ++i)
    mention(NameUse::Call, func, values[i].type().element_of(), static_cast<int>(i));
}

int lanes_of(const std::vector<Expr>& args) {
  int lanes = 1;
  for (const Expr& arg : args) {
    if (arg.defined()) lanes = std::max(lanes, arg.type().lanes());
  }
  return lanes;
}

}  // namespace retrograde::ir
