// print.cpp -- plans as text (plan_text.h).
#include <algorithm>

#include "autoschedule/plan/nest.h"
#include "autoschedule/plan/plan_text.h"
#include "diagnostics/error.h"
#include "graph/directives/directive_choices.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/text.h"

namespace retrograde::planning {

namespace {

constexpr std::array kind_words{"", "parallel", "vector", "unroll", "block", "thread", "lane"};
constexpr std::array concurrency_words{"", "atomic", "vouched", "racing", "atomic_racing"};
constexpr std::array other_words{"undecided", "inline", "root",   "at",     "each",
                                 "store",     "hoist",  "opaque", "fold",   "backward",
                                 "by",        "shared", "with",   once_word};

template <typename E, typename List>
bool read_choice(const List& names, const std::string& word, E& value) {
  const auto found =
      std::ranges::find_if(names, [&](const char* name) { return *name && word == name; });
  if (found == names.end()) return false;
  value = static_cast<E>(found - names.begin());
  return true;
}

}  // namespace

const char* kind_word(ForType kind) { return kind_words[static_cast<size_t>(kind)]; }
const char* concurrency_word(Concurrency concurrency) {
  return concurrency_words[static_cast<size_t>(concurrency)];
}
bool read_kind(const std::string& word, ForType& kind) {
  return read_choice(kind_words, word, kind);
}
bool read_concurrency(const std::string& word, Concurrency& concurrency) {
  return read_choice(concurrency_words, word, concurrency);
}
bool read_tail(const std::string& word, TailStrategy& tail) {
  return read_choice(graph::tail_choices, word, tail);
}
bool read_align(const std::string& word, LoopAlignStrategy& align) {
  return read_choice(graph::align_choices, word, align);
}
bool read_memory(const std::string& word, MemoryType& memory) {
  for (size_t m = 0; m < graph::memory_choices.size(); ++m) {
    if (word != ir::memory_name(static_cast<MemoryType>(m))) continue;
    memory = static_cast<MemoryType>(m);
    return true;
  }
  return false;
}
bool read_opacity(const std::string& word, Opacity& opacity) {
  for (int o = 1; o < opacity_count; ++o) {
    if (word != opacity_name(static_cast<Opacity>(o))) continue;
    opacity = static_cast<Opacity>(o);
    return true;
  }
  return false;
}

std::string name_text(const std::string& name) {
  ForType kind;
  Concurrency concurrency;
  TailStrategy tail;
  LoopAlignStrategy align;
  MemoryType memory;
  const bool is_word = std::ranges::find(other_words, name) != other_words.end() ||
                       read_kind(name, kind) || read_concurrency(name, concurrency) ||
                       read_tail(name, tail) || read_align(name, align) ||
                       read_memory(name, memory);
  return is_word ? "`" + name + "`" : ir::quote_name(name);
}

LoopText::LoopText(const graph::FuncContents& f, int stage, const Nest& nest)
    : nest_(nest), iterators_(iterators_of(f, stage)) {}

std::string LoopText::base(int iterator) const {
  if (iterator == once) return once_word;
  const auto i = static_cast<size_t>(iterator);
  if (i < iterators_.size()) return name_text(iterators_[i]);
  const Fusion& fusion = nest_.fusions[i - iterators_.size()];
  return "(" + part(fusion.inner) + " " + part(fusion.outer) + ")";
}

std::string LoopText::steps(const Part& part) const {
  if (part.step == 1) return "";
  if (!part.in_blocks) return text(":", part.step);
  const std::vector<Part> parts = parts_of(nest_, part.iterator);
  const Part* block = next_smaller(parts, part.step);
  RETROGRADE_ASSERT(block, "a step in blocks is larger than another step");
  return text(":", part.step / block->step, "*", block->step);
}

std::string LoopText::part(const Part& part) const {
  return base(part.iterator) + steps(part) +
         (part.tail == TailStrategy::Auto ? "" : text(" ", graph::choice_name(part.tail)));
}

std::string LoopText::place(size_t depth) const {
  const Loop& loop = nest_.loops[depth];
  if (!is_phase(nest_, depth)) return base(loop.iterator) + steps(loop);
  return text(base(loop.iterator), steps(loop), "%",
              next_larger(nest_, loop.iterator, loop.step)->step);
}

std::string LoopText::loop(size_t depth) const {
  const Loop& loop = nest_.loops[depth];
  std::string result = kind_word(loop.kind);
  result += (result.empty() ? "" : " ") + place(depth);
  if (loop.tail != TailStrategy::Auto) result += text(" ", graph::choice_name(loop.tail));
  if (loop.align != LoopAlignStrategy::Auto) result += text(" ", graph::choice_name(loop.align));
  return result;
}

std::string opaque_place(const graph::FuncContents& f, int stage, int depth) {
  const graph::LoopList& dims = f.stage(stage).schedule.dims;
  return name_text(dims[dims.size() - 1 - static_cast<size_t>(depth)].var);
}

namespace {

class PlanPrinter {
 public:
  explicit PlanPrinter(const Plan& plan) : plan_(plan) {}

  std::string run() const {
    std::string out;
    for (size_t f = plan_.funcs.size(); f-- > 0;) out += lines_of(static_cast<FuncId>(f));
    return out;
  }

  std::string place(const LoopRef& loop) const {
    const auto [func, stage] = loop.stage;
    const graph::FuncContents& f = func_of(func);
    std::string out = name_text(f.name);
    if (f.stage_count() > 1) out += text(".", stage);
    out += "/";
    if (loop.depth == around_all_loops) return out + once_word;
    if (plan_.of(func).opacity != Opacity::None) return out + opaque_place(f, stage, loop.depth);
    return out + LoopText(f, stage, plan_.nest(loop.stage)).place(static_cast<size_t>(loop.depth));
  }

  // Parts are separated by two spaces.
  std::string nest(StageId id) const {
    const Nest& nest = plan_.nest(id);
    const LoopText loops(func_of(id.func), id.stage, nest);
    std::string out;
    if (nest.shared_with) out += "  shared with " + place(*nest.shared_with);
    if (nest.concurrency != Concurrency::Independent)
      out += text("  ", concurrency_word(nest.concurrency));
    for (size_t d = 0; d < nest.loops.size(); ++d) out += (d == 0 ? "  " : ", ") + loops.loop(d);
    return out;
  }

 private:
  const Plan& plan_;

  const graph::FuncContents& func_of(FuncId func) const {
    return *plan_.program->funcs[static_cast<size_t>(func)];
  }

  std::string level(const Level& level) const {
    switch (level.kind) {
      case Level::Kind::Undecided:
        return "undecided";
      case Level::Kind::Inline:
        return "inline";
      case Level::Kind::Root:
        return "root";
      case Level::Kind::At:
        break;
    }
    return (level.in_each_stage ? "at each " : "at ") + place(level.loop);
  }

  std::string storage(const graph::FuncContents& f, const Storage& storage) const {
    std::string out;
    const auto name = [&](int16_t d) { return name_text(f.args[static_cast<size_t>(d)]); };
    if (storage.memory != MemoryType::Auto) out += text("  ", ir::memory_name(storage.memory));
    if (!std::ranges::is_sorted(storage.order)) out += "  (" + listed(storage.order, name) + ")";
    for (const Fold& fold : storage.folds)
      out += text("  fold ", name(fold.dimension), " by ", fold.extent,
                  fold.forward ? "" : " backward");
    return out;
  }

  std::string lines_of(FuncId id) const {
    const graph::FuncContents& f = func_of(id);
    const FuncPlan& func = plan_.of(id);
    std::string out = name_text(f.name) + "  " + level(func.placement.compute);
    if (func.placement.store.kind != Level::Kind::Undecided)
      out += "  store " + level(func.placement.store);
    if (func.placement.hoist.kind != Level::Kind::Undecided)
      out += "  hoist " + level(func.placement.hoist);
    out += storage(f, func.storage);
    if (func.opacity != Opacity::None)
      return text(out, "  opaque ", opacity_name(func.opacity), "\n");
    for (int s = 0; s < f.stage_count(); ++s) {
      const StageId stage{id, static_cast<int16_t>(s)};
      if (plan_.nest(stage) == loops_of_definition(f, s)) continue;
      if (f.stage_count() > 1) out += text("\n  .", s);
      out += nest(stage);
    }
    return out + "\n";
  }
};

}  // namespace

std::string to_text(const Plan& plan) { return PlanPrinter(plan).run(); }
std::string to_text(const Plan& plan, StageId stage) {
  const std::string out = PlanPrinter(plan).nest(stage);
  return out.substr(std::min<size_t>(out.size(), 2));
}
std::string to_text(const Plan& plan, const LoopRef& loop) { return PlanPrinter(plan).place(loop); }

}  // namespace retrograde::planning
