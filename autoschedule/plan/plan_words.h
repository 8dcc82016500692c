// plan_words.h -- a line of the text of a plan as words.
#pragma once

#include <string>
#include <vector>

namespace retrograde::planning {

struct Word {
  enum class Kind { Name, Number, Symbol, End } kind = Kind::End;
  std::string text;        // without back quotes
  bool is_quoted = false;  // a quoted name is no word of plans
  int column = 1;
};

class Words {
 public:
  // Requires: line …, column …: … must stand here.
  Words(std::string line, int number);

  const Word& now(size_t ahead = 0) const;
  bool at_end() const { return now().kind == Word::Kind::End; }
  bool is(const std::string& word, size_t ahead = 0) const;  // a symbol or a word of plans
  bool take(const std::string& word);
  std::string take_name(const std::string& expected);
  int64_t take_number(const std::string& expected);
  void skip() { ++next_; }

  // CompileError at the word: `expected` should be there.
  [[noreturn]] void fail(const std::string& expected, const Word& word) const;
  [[noreturn]] void fail(const std::string& expected) const { fail(expected, now()); }

 private:
  std::string line_;
  int number_;
  std::vector<Word> words_;
  size_t next_ = 0;

  Word quoted_word(size_t& at) const;
};

}  // namespace retrograde::planning
