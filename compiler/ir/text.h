// Keywords, type names and operators of IR text, shared by the printer and the parser.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {

const char* for_name(ForType type);
const char* partition_name(Partition partition);
const char* memory_name(MemoryType memory);
std::string kind_word(Kind op);
// An operator written between its operands, and its precedence.
struct InfixOperator {
  Kind kind;
  const char* symbol;
  int precedence;
};
constexpr int sum_precedence = 4, prefix_precedence = 6;
// Null when `kind` is not an infix operator.
const InfixOperator* infix_operator(Kind kind);
const InfixOperator* infix_operator(const std::string& symbol);
bool is_reserved(const std::string& word);  // whether it is a keyword, a type or an operator
// Reads a type name ("float32x8"); returns false for other words.
bool read_type(const std::string& word, Type& type);
// The name, in back quotes when it is no identifier or is reserved.
std::string quote_name(const std::string& name);

// The kinds of names: variables, buffers with their elements, Funcs and C functions with their values.
enum class NameUse : char { Variable = 'v', Buffer = '[', Call = '(' };

// The types of names, which allow the text to omit most of them. A declaration (let, for, allocate, realize) fixes a
// name's type; without one, the first mention does. A first mention without a type means int32. Printer and parser
// each keep such a table and visit names in the same order, so they agree.
class NameTypes {
 public:
  NameTypes() = default;
  // Adds to the names of `outer`, which is not changed and must outlive this table.
  explicit NameTypes(const NameTypes* outer) : outer_(outer) {}

  void declare(NameUse use, const std::string& name, Type type, int component = 0);
  // The type of a mention without a written type. Loads and calls have the lanes of their index or arguments, `lanes`;
  // the lanes of a variable are part of its type.
  Type implied(NameUse use, const std::string& name, int lanes, int component = 0) const;
  // Records a mention of this type: the first one fixes the type of an undeclared name.
  void mention(NameUse use, const std::string& name, Type type, int component = 0);
  // The same for every component of a Func.
  void declare_components(const std::string& func, const std::vector<Type>& types);
  void mention_components(const std::string& func, const std::vector<Expr>& values);

 private:
  static std::string key(NameUse use, const std::string& name, int component);
  const Type* find(const std::string& key) const;  // null when the name has none

  const NameTypes* outer_ = nullptr;
  std::unordered_map<std::string, Type> types_;
};

int lanes_of(const std::vector<Expr>& args);  // the lanes of a call with these arguments

}  // namespace retrograde::ir
