// parse.cpp -- reads the text form of plans (plan_text.h).
//
// Method: all lines first; then the places in loops of other Funcs, which may come later in the text.
#include <algorithm>
#include <sstream>
#include <unordered_map>

#include "autoschedule/plan/nest.h"
#include "autoschedule/plan/nest_parser.h"
#include "autoschedule/plan/plan_text.h"
#include "autoschedule/plan/plan_words.h"
#include "diagnostics/error.h"

namespace retrograde::planning {

namespace {

using graph::FuncContents;

class PlanParser {
 public:
  explicit PlanParser(const ProgramPtr& program) : program_(program) {
    for (const auto& func : undecided_plan(program).funcs) plans_.push_back(*func);
    for (size_t i = 0; i < program->funcs.size(); ++i)
      ids_[program->funcs[i]->name] = static_cast<FuncId>(i);
  }

  Plan run(const std::string& text) {
    std::istringstream in(text);
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
      Words words(line, number);
      if (words.at_end()) continue;
      words.is(".") ? read_stage(words) : read_func(words);
      if (!words.at_end()) words.fail("the end of the line");
    }
    for (const Reference& reference : references_) resolve(reference);
    Plan plan{program_, {}};
    for (FuncPlan& func : plans_) plan.funcs.push_back(std::make_shared<FuncPlan>(std::move(func)));
    return plan;
  }

 private:
  // A loop of another Func: `text` is without spaces.
  struct Reference {
    LoopRef* loop;
    std::string text;
    Words words;
    Word word;
  };
  const ProgramPtr program_;
  std::unordered_map<std::string, FuncId> ids_;
  std::vector<FuncPlan> plans_;
  std::vector<Reference> references_;
  std::vector<FuncId> read_;
  FuncId current_ = -1;

  const FuncContents& func(FuncId id) const { return *program_->funcs[static_cast<size_t>(id)]; }
  FuncPlan& plan(FuncId id) { return plans_[static_cast<size_t>(id)]; }

  FuncId id_of(const std::string& name, const Words& words, const Word& word) const {
    const auto found = ids_.find(name);
    if (found == ids_.end()) words.fail("a Func of the program", word);
    return found->second;
  }

  // ---- references ----

  // f/x, or f.1/x where f has several stages.
  void read_reference(Words& words, LoopRef& loop) {
    const Word word = words.now();
    std::string name = words.take_name("a Func of the program");
    std::optional<int64_t> stage;
    if (const size_t dot = word.is_quoted ? std::string::npos : name.find('.');
        dot != std::string::npos) {
      const std::string digits = name.substr(dot + 1);
      if (digits.empty() || digits.size() > 4 ||
          digits.find_first_not_of("0123456789") != std::string::npos)
        words.fail("the number of a stage behind \".\"", word);
      stage = std::stoi(digits);
      name = name.substr(0, dot);
    } else if (words.take(".")) {
      stage = words.is("0") ? (words.skip(), 0) : words.take_number("the number of a stage");
    }
    loop.stage.func = id_of(name, words, word);
    const int count = func(loop.stage.func).stage_count();
    if (stage ? *stage >= count : count > 1)
      words.fail(text("a Func and its stage, such as \"", name, ".0\","), word);
    loop.stage.stage = static_cast<int16_t>(stage.value_or(0));
    if (!words.take("/")) words.fail("\"/\" and a loop of " + quoted(name));
    const Word at = words.now();
    std::string place = read_place(words);
    references_.push_back({&loop, std::move(place), words, at});
  }

  void resolve(const Reference& reference) {
    LoopRef& loop = *reference.loop;
    const FuncContents& f = func(loop.stage.func);
    const bool is_opaque = plan(loop.stage.func).opacity != Opacity::None;
    const Nest* nest =
        is_opaque ? nullptr : &plan(loop.stage.func).nests[static_cast<size_t>(loop.stage.stage)];
    const size_t count =
        is_opaque ? f.stage(loop.stage.stage).schedule.dims.size() : nest->loops.size();
    std::string places;
    for (size_t d = 0; d < count; ++d) {
      const std::string place = is_opaque ? opaque_place(f, loop.stage.stage, static_cast<int>(d))
                                          : LoopText(f, loop.stage.stage, *nest).place(d);
      loop.depth = static_cast<int16_t>(d);
      if (without_spaces(place) == reference.text) return;
      places += (places.empty() ? "" : ", ") + quoted(place);
    }
    loop.depth = around_all_loops;
    if (reference.text != once_word)
      reference.words.fail("a loop of " + quoted(f.name) + ", whose loops are " +
                               (places.empty() ? "none" : places) + ",",
                           reference.word);
  }

  // ---- one Func ----

  void read_level(Words& words, Level& level) {
    if (words.take("undecided")) return;
    if (words.take("inline")) {
      level.kind = Level::Kind::Inline;
    } else if (words.take("root")) {
      level.kind = Level::Kind::Root;
    } else if (words.take("at")) {
      level.kind = Level::Kind::At;
      level.in_each_stage = words.take("each");
      read_reference(words, level.loop);
    } else {
      words.fail("a place (undecided, inline, root, at)");
    }
  }

  int16_t read_dimension(Words& words, const FuncContents& f) {
    const Word word = words.now();
    const std::string expected =
        text("a dimension of ", quoted(f.name), " (", listed(f.args, quoted), ")");
    const auto found = std::ranges::find(f.args, words.take_name(expected));
    if (found == f.args.end()) words.fail(expected, word);
    return static_cast<int16_t>(found - f.args.begin());
  }

  // A list of dimensions has commas; two loops that run as one do not.
  void read_order(Words& words, const FuncContents& f, Storage& storage) {
    if (!words.is("(") || !words.is(",", 2)) return;
    const Word word = words.now();
    storage.order.clear();
    do {
      words.skip();
      storage.order.push_back(read_dimension(words, f));
    } while (words.is(","));
    if (!words.take(")")) words.fail("a comma or \")\"");
    std::vector<int16_t> sorted = storage.order;
    std::ranges::sort(sorted);
    const bool is_whole = static_cast<int>(sorted.size()) == f.dimensions() &&
                          std::ranges::adjacent_find(sorted) == sorted.end();
    if (!is_whole) words.fail("a list of all dimensions, each once,", word);
  }

  void read_storage(Words& words, const FuncContents& f, Storage& storage) {
    if (!words.now().is_quoted && read_memory(words.now().text, storage.memory)) words.skip();
    read_order(words, f, storage);
    while (words.take("fold")) {
      Fold fold;
      fold.dimension = read_dimension(words, f);
      if (!words.take("by")) words.fail("\"by\"");
      fold.extent = words.take_number("the extent of a window");
      fold.forward = !words.take("backward");
      storage.folds.push_back(fold);
    }
  }

  void read_opaque(Words& words, FuncPlan& func) {
    if (!read_opacity(words.now().text, func.opacity))
      words.fail("the reason why the Func keeps its directives");
    words.skip();
    func.nests.clear();
  }

  void read_func(Words& words) {
    const Word word = words.now();
    current_ = id_of(words.take_name("a Func of the program"), words, word);
    if (std::ranges::find(read_, current_) != read_.end())
      words.fail("a Func that has no line above", word);
    read_.push_back(current_);
    const FuncContents& f = func(current_);
    FuncPlan& func = plan(current_);
    read_level(words, func.placement.compute);
    if (words.take("store")) read_level(words, func.placement.store);
    if (words.take("hoist")) read_level(words, func.placement.hoist);
    read_storage(words, f, func.storage);
    if (words.take("opaque")) return read_opaque(words, func);
    if (func.opacity != Opacity::None) words.fail("\"opaque\", since a C function computes it,");
    if (!words.at_end() && f.stage_count() == 1) read_nest(words, 0);
  }

  // .1 loops
  void read_stage(Words& words) {
    const Word word = words.now();
    words.skip();
    if (current_ < 0 || plan(current_).nests.size() < 2)
      words.fail("a Func; only those of several stages have lines for these,", word);
    const int64_t stage =
        words.is("0") ? (words.skip(), 0) : words.take_number("the number of a stage");
    if (stage >= func(current_).stage_count())
      words.fail(text("a stage of ", quoted(func(current_).name)), word);
    read_nest(words, static_cast<int>(stage));
  }

  void read_nest(Words& words, int stage) {
    Nest& nest = plan(current_).nests[static_cast<size_t>(stage)];
    if (words.take("shared")) {
      if (!words.take("with")) words.fail("\"with\"");
      read_reference(words, nest.shared_with.emplace());
    }
    if (!words.now().is_quoted && read_concurrency(words.now().text, nest.concurrency))
      words.skip();
    if (!words.at_end()) {
      NestParser(func(current_), stage, words).read(nest);
    } else if (!nest.loops.empty()) {
      words.fail("the loops of " + quoted(func(current_).name));
    }
  }
};

}  // namespace

Plan parse_plan(const std::string& text, const ProgramPtr& program) {
  return PlanParser(program).run(text);
}

}  // namespace retrograde::planning
