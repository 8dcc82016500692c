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
// Null when `kind` is not an infix operator.
const InfixOperator* infix_operator(Kind kind);
const InfixOperator* infix_operator(const std::string& symbol);
bool is_reserved(const std::string& word);  // whether it is a keyword, a type or an operator
// Reads a type name ("float32x8"); returns false for other words.
bool read_type(const std::string& word, Type& type);
// The name, in back quotes when it is no identifier or is reserved.
std::string quote_name(const std::string& name);

// What a mention of a name names: a variable, the elements of a buffer, the values of a Func or C function.
enum class NameUse : char { Variable = 'v', Buffer = '[', Call = '(' };

// The types that names have where the text leaves them out. A declaration (let, for, allocate, realize) says a name's
// type; without one, its first mention does. A first mention without a type is of int32. The printer and the parser
// each keep such a table and meet the names in the same order, so that they agree.
class NameTypes {
 public:
  NameTypes() = default;
  // On top of `outer`, which stays as it is and must outlive this.
  explicit NameTypes(const NameTypes* outer) : outer_(outer) {}

  void declare(NameUse use, const std::string& name, Type type, int component = 0);
  // The type of a mention without one; `lanes` are those of its index or arguments. A variable has its own.
  Type implied(NameUse use, const std::string& name, int lanes, int component = 0) const;
  // A mention of this type: it settles the type of a name that has none.
  void mention(NameUse use, const std::string& name, Type type, int component = 0);
  // Of every component of a Func.
  void declare_components(const std::string& func, const std::vector<Type>& types);
  void mention_components(const std::string& func, const std::vector<Expr>& values);

 private:
  static std::string key(NameUse use, const std::string& name, int component);
  const Type* find(const std::string& key) const;  // null when the name has none

  const NameTypes* outer_ = nullptr;
  std::unordered_map<std::string, Type> types_;
};

int lanes_of(const std::vector<Expr>& args);  // of a call with these arguments

}  // namespace retrograde::ir
