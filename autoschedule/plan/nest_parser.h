// nest_parser.h -- reads the loops of one stage.
#pragma once

#include <string>
#include <vector>

#include "autoschedule/plan/plan.h"
#include "autoschedule/plan/plan_words.h"

namespace retrograde::planning {

// The text between two words without spaces, to compare it with what the printer writes.
std::string without_spaces(const std::string& text);

// Reads loops up to the end of the line. Requires: line …, column …: … must stand here.
class NestParser {
 public:
  NestParser(const graph::FuncContents& f, int stage, Words& words);
  void read(Nest& nest);

 private:
  const graph::FuncContents& f_;
  const int stage_;
  const std::vector<std::string> iterators_;
  Words& words_;

  int16_t read_base(Nest& nest);
  void read_steps(Part& part);
  void read_tail(Part& part);
  Part read_part(Nest& nest);
  Loop read_loop(Nest& nest);
  void check_written_so(const Nest& nest, const std::vector<Word>& starts,
                        const std::vector<std::string>& places) const;
};

// Skips a loop as others refer to it, and returns its text without spaces.
std::string read_place(Words& words);

}  // namespace retrograde::planning
