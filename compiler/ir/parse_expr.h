// parse_expr.h -- a recursive-descent parser of the expressions of IR text; print_expr.cpp shows the language.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "diagnostics/error.h"
#include "ir/expr.h"
#include "ir/text.h"
#include "ir/token_reader.h"

namespace retrograde::ir {

class ExprParser : protected TokenReader {
 public:
  explicit ExprParser(const std::string& text, NameTypes types = {})
      : TokenReader(text), types_(std::move(types)) {}

  Expr whole_expr();

 protected:
  // Runs a builder and reports its error at the position in the text.
  template <class F>
  auto build(const Token& at, F make) {
    try {
      return make();
    } catch (const InternalError& error) {
      refuse_operands(at, error);
    }
  }
  [[noreturn]] static void refuse_operands(const Token& at, const InternalError& error);
  Expr expr();
  // An expression followed, or preceded, by a mark.
  Expr expr_before(const char* mark);
  Expr expr_behind(const char* mark);
  std::vector<Expr> expr_list(const char* close);
  std::vector<Expr> arguments(size_t count);

  NameTypes& types() { return types_; }

 private:
  NameTypes types_;
  std::unordered_map<std::string, Expr> shared_;  // nodes by their names

  // The type written after a mention of a name, or else the implied one.
  Type type_suffix(NameUse use, const std::string& name, int lanes, int component = 0);
  const InfixOperator* infix_ahead() const;
  Expr infix(int min_precedence);
  Expr prefix();
  Expr number(bool negative);
  Expr shared_block();
  Expr let_expr();
  Expr named();
  Expr keyword_call(const Token& keyword);
  Expr operator_call(Op op);
  Expr call(CallType call_type);
  // A load, or a variable when no bracket follows.
  Expr load(const std::string& name);
  Expr shuffle();
  Expr reduce();
};

}  // namespace retrograde::ir
