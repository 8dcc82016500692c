#include "tuning/loops_in_words.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "graph/names.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "lower/program.h"
#include "tuning/known_value.h"

namespace retrograde::tuning {

namespace {

// A variable of a schedule as the user wrote it.
struct LoopVariable {
  std::string name;
  bool is_reduction = false;
};

// The variable that was split, renamed or fused into `var`: "x" for both loops of split(x, xo, xi, 8), "x and y" for
// fuse(x, y, t). Splits are followed from the last to the first, since a split may reuse a name.
std::string origin_of(std::string var, const graph::StageLoops& loops) {
  for (size_t i = loops.splits.size(); i-- > 0;) {
    const graph::Split& split = loops.splits[i];
    if (split.kind == graph::Split::Kind::Fuse) {
      if (var == split.old_var) return split.inner + " and " + split.outer;
    } else if (var == split.outer || var == split.inner) {
      var = split.old_var;
    }
  }
  return var;
}

using LoopVariables = std::unordered_map<std::string, LoopVariable>;  // by the name of the loop

void add_variables(const std::string& prefix, const graph::StageLoops& loops, LoopVariables& all) {
  for (const graph::Dim& dim : loops.dims) {
    const std::string name = graph::without_numbers(origin_of(dim.var, loops));
    all.emplace(prefix + dim.var, LoopVariable{name, dim.is_reduction});
  }
  for (const graph::StageLoops& special : loops.specializations)
    add_variables(prefix, special, all);
}

LoopVariables variables_of(const std::vector<FuncPtr>& scheduled) {
  LoopVariables all;
  for (const FuncPtr& f : graph::topological_order(scheduled)) {
    for (int s = 0; s < f->stage_count(); s++)
      add_variables(lower::stage_prefix(f->name, s), f->stage(s).schedule, all);
  }
  return all;
}

std::string number(double count) { return std::to_string(std::llround(count)); }

class LoopReader {
 public:
  LoopReader(const std::vector<FuncPtr>& scheduled, const ProgramSizes& sizes)
      : variables_(variables_of(scheduled)), values_(sizes) {}

  std::map<std::string, std::vector<DefinitionLoops>> read(const Stmt& nests) {
    visit(nests);
    return std::move(found_);
  }

 private:
  struct Loop {
    std::string func, stage, words, var;
    ForType runs = ForType::Serial;
    bool is_reduction = false;
    double trips = 1;
  };
  const LoopVariables variables_;
  KnownValues values_;
  std::vector<Loop> around_;
  std::map<std::string, std::vector<DefinitionLoops>> found_;

  void visit(const Stmt& s) {
    if (!s.defined()) return;
    match(
        s, [&](const For& n) { visit_loop(n); },
        [&](const LetStmt& n) {
          values_.bind(n.name, values_.of(n.value));
          visit(n.body);
        },
        [&](const Provide& n) { note(n.name); },
        [&](const StmtNode&) {
          for_each_child(
              s, [](const Expr&) {}, [&](const Stmt& part) { visit(part); });
        });
  }

  void visit_loop(const For& n) {
    const KnownValue min = values_.of(n.min), extent = values_.of(n.extent);
    around_.push_back(described(n, extent.at));
    values_.enter(n.name, min, std::max(1.0, extent.at), {});
    visit(n.body);
    values_.leave();
    around_.pop_back();
  }

  Loop described(const For& n, double trips) const {
    const lower::LoopName name = lower::decode_loop_name(n.name);
    Loop loop{name.func, name.stage, "", graph::without_numbers(name.var), n.runs, false, trips};
    if (const auto known = variables_.find(n.name); known != variables_.end()) {
      loop.var = known->second.name;
      loop.is_reduction = known->second.is_reduction;
    }
    const std::string count = " (" + number(trips) + ")";
    switch (n.runs) {
      case ForType::Serial:
        loop.words = loop.var + (loop.is_reduction ? " one after the other" : "") + count;
        break;
      case ForType::Parallel:
        loop.words = loop.var + " in parallel" + count;
        break;
      case ForType::Vectorized:
        loop.words = "vectors of " + number(trips) + " along " + loop.var;
        break;
      case ForType::Unrolled:
        loop.words = loop.var + " unrolled" + count;
        break;
      case ForType::GpuBlock:
        loop.words = "blocks along " + loop.var + count;
        break;
      case ForType::GpuThread:
      case ForType::GpuLane:
        loop.words = "threads along " + loop.var + count;
        break;
    }
    return loop;
  }

  void note(const std::string& func) {
    DefinitionLoops result;
    std::string outer, own, consumer;
    for (const Loop& loop : around_) {
      result.is_parallel |= runs_at_once(loop.runs) && loop.trips > 1;
      result.is_vectorized |= loop.runs == ForType::Vectorized && loop.trips > 1;
      const bool is_own = loop.func == lower::original_name(func);
      if (is_own) {
        result.stage = std::stoi(loop.stage);
        result.is_interleaved |=
            loop.runs == ForType::Unrolled && !loop.is_reduction && loop.trips > 1;
        if (loop.runs == ForType::Serial && loop.is_reduction) result.serial_trips *= loop.trips;
      }
      if (loop.trips <= 1 && loop.runs != ForType::Vectorized) continue;
      if (!is_own) consumer = loop.func;
      std::string& text = is_own ? own : outer;
      text += (text.empty() ? "" : ", ") + loop.words;
    }
    if (own.empty()) own = "one element";
    if (!consumer.empty())
      own = "inside " + retrograde::quoted(graph::without_numbers(consumer)) + " over " + outer +
            ": " + own;
    result.text = own;
    add(lower::original_name(func), std::move(result));
  }

  // A definition that is computed at several places with the same loops is listed once.
  void add(const std::string& func, DefinitionLoops loops) {
    std::vector<DefinitionLoops>& known = found_[func];
    const bool is_known = std::ranges::any_of(known, [&](const DefinitionLoops& other) {
      return other.stage == loops.stage && other.text == loops.text;
    });
    if (!is_known) known.push_back(std::move(loops));
  }
};

}  // namespace

std::map<std::string, std::vector<DefinitionLoops>> loops_in_words(
    const Stmt& nests, const std::vector<FuncPtr>& scheduled, const ProgramSizes& sizes) {
  return LoopReader(scheduled, sizes).read(nests);
}

}  // namespace retrograde::tuning
