// The lexer of IR text.
#include "ir/lexer.h"

#include <cctype>

#include "diagnostics/error.h"

namespace retrograde::ir {

namespace {
bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)); }
bool starts_name(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) || c == '_' || c == '$';
}
bool continues_name(char c) { return starts_name(c) || is_digit(c) || c == '.'; }
}  // namespace

void Lexer::fail(const Token& at, const std::string& expected) {
  const std::string found = at.kind == Token::Kind::End ? "the end of the text" : quoted(at.text);
  user_error("read IR text",
             text("line ", at.line, ", column ", at.column, ": expected ", expected),
             "found " + found,
             "The language is the printer's output; compare with the text of a similar program");
}

void Lexer::skip_space() {
  while (at_ < text_.size()) {
    if (peek() == '/' && peek(1) == '/') {
      while (at_ < text_.size() && peek() != '\n') advance();
    } else if (std::isspace(static_cast<unsigned char>(peek()))) {
      advance();
    } else {
      return;
    }
  }
}

Token Lexer::next() {
  skip_space();
  Token token;
  token.line = line_;
  token.column = column_;
  if (at_ >= text_.size()) return token;
  if (starts_name(peek())) {
    read_name(token);
  } else if (peek() == '`') {
    read_quoted_name(token);
  } else if (is_digit(peek())) {
    read_number(token);
  } else if (peek() == '"') {
    read_string(token);
  } else {
    read_punctuation(token);
  }
  return token;
}

void Lexer::read_name(Token& token) {
  token.kind = Token::Kind::Name;
  while (continues_name(peek())) {
    token.text += peek();
    advance();
  }
}

void Lexer::read_quoted_name(Token& token) {
  token.kind = Token::Kind::Name;
  token.quoted = true;
  for (advance();; advance()) {
    if (at_ >= text_.size())
      fail(Token{Token::Kind::End, {}, false, line_, column_}, "a closing back quote");
    if (peek() == '`') {
      advance();
      if (peek() != '`') return;  // two back quotes inside a name stand for one
    }
    token.text += peek();
  }
}

// digits [. digits] [e digits] and then a suffix of letters, digits and underscores.
void Lexer::read_number(Token& token) {
  token.kind = Token::Kind::Number;
  const auto take = [&] {
    token.text += peek();
    advance();
  };
  while (is_digit(peek())) take();
  if (peek() == '.' && is_digit(peek(1))) take();
  while (is_digit(peek())) take();
  if (peek() == 'e') {
    take();
    if (peek() == '+' || peek() == '-') take();
  }
  while (continues_name(peek()) && peek() != '.') take();
}

void Lexer::read_string(Token& token) {
  token.kind = Token::Kind::String;
  for (advance(); peek() != '"'; advance()) {
    if (at_ >= text_.size())
      fail(Token{Token::Kind::End, {}, false, line_, column_}, "a closing quote");
    const bool escaped = peek() == '\\';
    if (escaped) advance();
    token.text += escaped && peek() == 'n' ? '\n' : peek();
  }
  advance();
}

void Lexer::read_punctuation(Token& token) {
  static const std::string singles = "()[]{}<>,;:.=+-*/%!";
  static const char* const doubles[] = {"<=", ">=", "==", "!=", "&&", "||"};
  token.kind = Token::Kind::Punctuation;
  if (peek() == '#') {
    token.kind = Token::Kind::Shared;
    do {
      token.text += peek();
      advance();
    } while (is_digit(peek()));
    return;
  }
  for (const char* symbol : doubles) {
    if (text_.compare(at_, 2, symbol) == 0) {
      token.text = symbol;
      advance();
      advance();
      return;
    }
  }
  token.text = std::string(1, peek());
  if (singles.find(peek()) == std::string::npos) fail(token, "a name, a number or punctuation");
  advance();
}

}  // namespace retrograde::ir
