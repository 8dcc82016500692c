#include "autoschedule/plan/nest_parser.h"

#include <algorithm>

#include "autoschedule/plan/nest.h"
#include "autoschedule/plan/plan_text.h"
#include "diagnostics/error.h"
#include "graph/definitions/define.h"

namespace retrograde::planning {

std::string without_spaces(const std::string& text) {
  std::string out = text;
  std::erase(out, ' ');
  return out;
}

namespace {

std::string word_text(const Word& word) {
  return word.kind == Word::Kind::Name ? without_spaces(name_text(word.text)) : word.text;
}

// The word as the printer would write it: words of plans stay without quotes.
std::string printed(const Word& word) { return word.is_quoted ? word_text(word) : word.text; }

}  // namespace

std::string read_place(Words& words) {
  std::string out;
  int depth = 0;
  do {
    if (words.at_end()) words.fail("a loop");
    depth += words.is("(") ? 1 : words.is(")") ? -1 : 0;
    out += printed(words.now());
    words.skip();
  } while (depth > 0);
  while (words.is(":") || words.is("*") || words.is("%")) {
    out += words.now().text;
    words.skip();
    out += std::to_string(words.take_number("a number of points"));
  }
  return out;
}

NestParser::NestParser(const graph::FuncContents& f, int stage, Words& words)
    : f_(f), stage_(stage), iterators_(iterators_of(f, stage)), words_(words) {}

int16_t NestParser::read_base(Nest& nest) {
  if (words_.take("(")) {
    const Part inner = read_part(nest);
    const Part outer = read_part(nest);
    if (!words_.take(")")) words_.fail("\")\" behind two loops that run as one");
    const Fusion fusion{inner, outer};
    const auto found = std::ranges::find(nest.fusions, fusion);
    const auto number = static_cast<size_t>(found - nest.fusions.begin());
    if (found == nest.fusions.end()) nest.fusions.push_back(fusion);
    return static_cast<int16_t>(iterators_.size() + number);
  }
  if (words_.take(once_word)) return once;
  const Word word = words_.now();
  const std::string expected =
      text("a loop of ", quoted(stage_name(f_, stage_)), ", whose iterators are ",
           iterators_.empty() ? "none" : listed(iterators_, quoted));
  const auto found = std::ranges::find(iterators_, words_.take_name(expected));
  if (found == iterators_.end()) words_.fail(expected, word);
  return static_cast<int16_t>(found - iterators_.begin());
}

void NestParser::read_steps(Part& part) {
  if (!words_.take(":")) return;
  const Word word = words_.now();
  part.step = words_.take_number("a number of points");
  if (words_.take("*")) {
    part.step *= words_.take_number("the number of points in a block");
    part.in_blocks = true;
  }
  if (part.step > INT32_MAX) words_.fail("a step that fits an int32", word);
}

void NestParser::read_tail(Part& part) {
  if (!words_.now().is_quoted && planning::read_tail(words_.now().text, part.tail)) words_.skip();
}

Part NestParser::read_part(Nest& nest) {
  Part part;
  part.iterator = read_base(nest);
  read_steps(part);
  read_tail(part);
  return part;
}

Loop NestParser::read_loop(Nest& nest) {
  Loop loop;
  if (!words_.now().is_quoted && read_kind(words_.now().text, loop.kind)) words_.skip();
  loop.iterator = read_base(nest);
  read_steps(loop);
  if (words_.take("%")) words_.take_number("the step of a loop inside");
  read_tail(loop);
  if (!words_.now().is_quoted && read_align(words_.now().text, loop.align)) words_.skip();
  return loop;
}

// Blocks and remainders mention the steps of other loops.
void NestParser::check_written_so(const Nest& nest, const std::vector<Word>& starts,
                                  const std::vector<std::string>& places) const {
  for (size_t d = 0; d < nest.loops.size(); ++d) {
    const std::vector<Part> parts = parts_of(nest, nest.loops[d].iterator);
    if (nest.loops[d].in_blocks && !next_smaller(parts, nest.loops[d].step))
      words_.fail("a step without blocks, since the loop has no smaller one,", starts[d]);
    const std::string written = LoopText(f_, stage_, nest).place(d);
    if (places[d] != without_spaces(written))
      words_.fail(quoted(written) + ", which follows from the other loops,", starts[d]);
  }
}

void NestParser::read(Nest& nest) {
  nest.loops.clear();
  std::vector<Word> starts;
  std::vector<std::string> places;
  do {
    ForType kind;
    const size_t skipped = !words_.now().is_quoted && read_kind(words_.now().text, kind) ? 1 : 0;
    Words ahead = words_;
    for (size_t i = 0; i < skipped; ++i) ahead.skip();
    starts.push_back(ahead.now());
    nest.loops.push_back(read_loop(nest));
    places.push_back(read_place(ahead));
  } while (words_.take(","));
  if (!words_.at_end()) words_.fail("a comma or the end of the line");
  check_written_so(nest, starts, places);
  nest = with_ordered_fusions(nest, static_cast<int>(iterators_.size()));
}

}  // namespace retrograde::planning
