#include "ir/token_reader.h"

#include <charconv>

#include "diagnostics/error.h"
#include "ir/text.h"

namespace retrograde::ir {

namespace {

constexpr int max_depth = 2000;

}  // namespace

bool TokenReader::is(const char* text) const {
  if (token_.kind == Token::Kind::Name) return !token_.quoted && token_.text == text;
  return token_.kind == Token::Kind::Punctuation && token_.text == text;
}

bool TokenReader::ahead_is(const char* text) const {
  return ahead_.kind == Token::Kind::Punctuation && ahead_.text == text;
}

Token TokenReader::take() {
  Token result = std::move(token_);
  token_ = std::move(ahead_);
  ahead_ = lexer_.next();
  return result;
}

bool TokenReader::accept(const char* text) {
  if (!is(text)) return false;
  take();
  return true;
}

void TokenReader::expect(const char* text) {
  if (!accept(text)) fail(quoted(text));
}

std::string TokenReader::name() {
  if (token_.kind != Token::Kind::Name) fail("a name");
  return take().text;
}

int TokenReader::integer() {
  int value = 0;
  const std::string& digits = token_.text;
  const auto end = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (token_.kind != Token::Kind::Number || end.ptr != digits.data() + digits.size())
    fail("an integer");
  take();
  return value;
}

Type TokenReader::type() {
  Type result;
  if (token_.kind != Token::Kind::Name || !read_type(token_.text, result)) fail("a type");
  take();
  return result;
}

Type TokenReader::type_in(const char* open, const char* close) {
  expect(open);
  const Type result = type();
  expect(close);
  return result;
}

TokenReader::Depth::Depth(TokenReader& reader) : reader_(reader) {
  if (++reader_.depth_ > max_depth) reader_.fail("a text that nests less deeply");
}

}  // namespace retrograde::ir
