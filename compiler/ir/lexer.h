// The lexer of IR text (print.cpp shows the language).
#pragma once

#include <cstdint>
#include <string>

namespace retrograde::ir {

struct Token {
  enum class Kind : uint8_t { Name, Number, String, Shared, Punctuation, End };
  Kind kind = Kind::End;
  std::string text;     // a name without its back quotes; a string without quotes and escapes
  bool quoted = false;  // a name in back quotes is never a keyword
  int line = 1, column = 1;
};

class Lexer {
 public:
  explicit Lexer(const std::string& text) : text_(text) {}
  Token next();  // UserError when no token can start here
  [[noreturn]] static void fail(const Token& at, const std::string& expected);

 private:
  void skip_space();
  void advance() {
    ++column_;
    if (text_[at_++] == '\n') ++line_, column_ = 1;
  }
  char peek(size_t ahead = 0) const {
    return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0';
  }
  void read_name(Token& token);
  void read_quoted_name(Token& token);
  void read_number(Token& token);
  void read_string(Token& token);
  void read_punctuation(Token& token);

  const std::string& text_;
  size_t at_ = 0;
  int line_ = 1, column_ = 1;
};

}  // namespace retrograde::ir
