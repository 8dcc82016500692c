// Keywords, type names and operators of IR text, shared by the printer and the parser.
#pragma once

#include <string>

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

}  // namespace retrograde::ir
