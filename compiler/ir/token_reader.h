// token_reader.h -- reads IR text token by token; the base of the parsers of expressions and statements.
#pragma once

#include <string>
#include <type_traits>
#include <vector>

#include "ir/lexer.h"
#include "ir/type.h"

namespace retrograde::ir {

class TokenReader {
 protected:
  explicit TokenReader(const std::string& text)
      : lexer_(text), token_(lexer_.next()), ahead_(lexer_.next()) {}

  bool at_end() const { return token_.kind == Token::Kind::End; }
  bool is(const char* text) const;        // whether it is the current token
  bool ahead_is(const char* text) const;  // whether the token after it is this punctuation
  const Token& token() const { return token_; }
  Token take();
  bool accept(const char* text);  // takes the token if it is this one
  void expect(const char* text);
  [[noreturn]] void fail(const std::string& expected) const { Lexer::fail(token_, expected); }

  std::string name();
  int integer();
  Type type();
  Type type_in(const char* open, const char* close);
  // Calls `read` once or more, with commas between.
  template <class Read>
  std::vector<std::invoke_result_t<const Read&>> several(const Read& read) {
    std::vector<decltype(read())> result;
    do result.push_back(read());
    while (accept(","));
    return result;
  }

  // Limits the nesting of a text while it exists: the C++ stack limits the depth of the parser.
  class Depth {
   public:
    explicit Depth(TokenReader& reader);
    ~Depth() { --reader_.depth_; }

   private:
    TokenReader& reader_;
  };

 private:
  Lexer lexer_;
  Token token_, ahead_;
  int depth_ = 0;
};

}  // namespace retrograde::ir
