// Words that the printer and the parser share.
#pragma once

#include <string>

#include "ir/expr.h"

namespace retrograde::ir {

const char* for_name(ForType type);
const char* partition_name(Partition partition);
const char* memory_name(MemoryType memory);
std::string kind_word(Kind op);
// An operator that is written between its operands, and how tightly it binds them.
struct InfixOperator {
  Kind kind;
  const char* symbol;
  int precedence;
};
// Null when it is none.
const InfixOperator* infix_operator(Kind kind);
const InfixOperator* infix_operator(const std::string& symbol);
bool is_reserved(const std::string& word);  // a keyword, a type or an operator
// The type of that name ("float32x8"); nothing when it is none.
bool read_type(const std::string& word, Type& type);
// As it is, or in back quotes when it is not an identifier or is reserved.
std::string quote_name(const std::string& name);

}  // namespace retrograde::ir
