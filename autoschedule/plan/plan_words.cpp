#include "autoschedule/plan/plan_words.h"

#include <algorithm>
#include <cctype>
#include <charconv>

#include "diagnostics/error.h"

namespace retrograde::planning {

namespace {

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }
bool begins_name(char c) { return std::isalpha(static_cast<unsigned char>(c)) || c == '_'; }
bool continues_name(char c) { return begins_name(c) || is_digit(c) || c == '.' || c == '$'; }

}  // namespace

Words::Words(std::string line, int number) : line_(std::move(line)), number_(number) {
  for (size_t at = 0; at < line_.size();) {
    if (std::isspace(static_cast<unsigned char>(line_[at]))) {
      ++at;
    } else if (line_[at] == '`') {
      words_.push_back(quoted_word(at));
    } else {
      const bool is_name = begins_name(line_[at]), is_number = is_digit(line_[at]);
      size_t end = at + 1;
      while (end < line_.size() &&
             ((is_name && continues_name(line_[end])) || (is_number && is_digit(line_[end]))))
        ++end;
      const Word::Kind kind = is_name     ? Word::Kind::Name
                              : is_number ? Word::Kind::Number
                                          : Word::Kind::Symbol;
      words_.push_back({kind, line_.substr(at, end - at), false, static_cast<int>(at) + 1});
      at = end;
    }
  }
  words_.push_back({Word::Kind::End, "", false, static_cast<int>(line_.size()) + 1});
}

// A back quote inside of a name is written twice.
Word Words::quoted_word(size_t& at) const {
  Word word{Word::Kind::Name, "", true, static_cast<int>(at) + 1};
  for (++at; at < line_.size(); ++at) {
    if (line_[at] == '`' && (at + 1 == line_.size() || line_[at + 1] != '`')) break;
    if (line_[at] == '`') ++at;
    word.text += line_[at];
  }
  if (at >= line_.size()) fail("the second back quote of a name", word);
  ++at;
  return word;
}

const Word& Words::now(size_t ahead) const {
  return words_[std::min(next_ + ahead, words_.size() - 1)];
}

bool Words::is(const std::string& word, size_t ahead) const {
  const Word& next = now(ahead);
  return next.kind != Word::Kind::End && !next.is_quoted && next.text == word;
}

bool Words::take(const std::string& word) {
  const bool found = is(word);
  if (found) ++next_;
  return found;
}

std::string Words::take_name(const std::string& expected) {
  if (now().kind != Word::Kind::Name) fail(expected);
  return words_[next_++].text;
}

int64_t Words::take_number(const std::string& expected) {
  int64_t value = 0;
  const std::string& digits = now().text;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool fits = error == std::errc() && value > 0 && value <= INT32_MAX;
  if (now().kind != Word::Kind::Number || !fits) fail(expected);
  ++next_;
  return value;
}

void Words::fail(const std::string& expected, const Word& word) const {
  user_error("read the text of a plan",
             text("line ", number_, ", column ", word.column, ": ", expected, " must stand here"),
             "the line says " + quoted(line_), "Write it as plan_text.h shows");
}

}  // namespace retrograde::planning
