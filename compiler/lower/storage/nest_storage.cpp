#include "lower/storage/nest_storage.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/markers.h"
#include "lower/checks/nest_checks.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

// Whether a directive that names a loop of a Func refers to this loop; the loop may belong to any stage.
bool is_named_by(const LoopLevel& level, const Loop& loop) {
  if (level.kind != LoopLevel::Kind::At) return false;
  const LoopName name = decode_loop_name(loop.known_as());
  return name.func == level.func && name.var == level.var;
}

}  // namespace

std::vector<Loop> loops_to_storage(const LoopedFunc& f, const ComputePlace& site) {
  std::vector<Loop> loops;
  if (is_stored_where_computed(f) || f.is_output) return loops;
  for (const Loop& loop : site.around) {
    if (is_named_by(f.schedule.store_level, loop)) break;
    loops.push_back(loop);
  }
  return loops;
}

namespace {

const StorageRule* rule_of(const LoopedFunc& f, size_t d) {
  return first_where(f.schedule.storage_rules,
                     [&](const StorageRule& rule) { return rule.var == f.func->args[d]; });
}

void apply(const StorageRule& rule, const LoopedFunc& f, size_t d, Range& range, Expr& factor,
           std::vector<Stmt>& checks) {
  const int dimension = static_cast<int>(d);
  if (rule.fold.defined() &&
      !factor.defined()) {  // no loop passes values on: the storage must hold the whole extent
    checks.push_back(fold_check(f, dimension, range.extent, rule.fold));
    factor = rule.fold;
  }
  if (rule.bound.defined()) {
    checks.push_back(storage_check(f, dimension, range.extent, rule.bound));
    range.extent = rule.bound;
  }
  if (rule.alignment.defined())
    range.extent = simplify((range.extent + rule.alignment - 1) / rule.alignment * rule.alignment);
}

// The dimensions of f, innermost first; empty if that is the order in which they are declared.
std::vector<int> storage_order(const LoopedFunc& f) {
  const std::vector<std::string>& args = f.func->args;
  if (f.schedule.storage_dims == args) return {};
  return mapped(f.schedule.storage_dims, [&](const std::string& var) {
    return static_cast<int>(std::ranges::find(args, var) - args.begin());
  });
}

Stmt realize_place(const LoopedFunc& f, const Box& room, const Stmt& stmt) {
  check_room(f, room);
  std::vector<Range> ranges;
  for (const Interval& side : room) ranges.push_back({0, simplify(side.max + 1)});
  return make_realize(place_name(f.name()), f.func->types, f.schedule.memory, ranges, stmt);
}

// The number of iterations that a producer may be ahead in folded storage; 0 means any number.
int room_in_folds(const std::vector<Fold>& folds, const std::vector<Slide>& slides,
                  const Box& touched) {
  const auto extent = [](const Interval& side) {
    return as_const_int(simplify(without_likely(side.max - side.min + 1)));
  };
  int room = 0;
  for (size_t d = 0; d < folds.size(); d++) {
    if (!folds[d].factor.defined()) continue;
    auto slide = std::ranges::find(slides, static_cast<int>(d), &Slide::dimension);
    const auto fold = as_const_int(folds[d].factor), window = extent(touched[d]);
    const auto step = slide == slides.end() ? window : extent(slide->part);
    const bool known = fold && window && step && *step > 0 && *fold >= *window;
    const int here = known ? static_cast<int>((*fold - *window) / *step) + 1 : 1;
    room = room == 0 ? here : std::min(room, here);
  }
  return room;
}

}  // namespace

NestStorage::NestStorage(const Program& program, bool folds)
    : program_(program), folds_any_(folds) {
  const auto note = [&](const LoopLevel& level) {
    if (level.kind == LoopLevel::Kind::At) sites_.insert(level.func + "\n" + level.var);
  };
  for (const LoopedFunc& f : program.funcs) {
    note(f.schedule.store_level);
    if (is_hoisted(f)) note(f.schedule.hoist_level);
  }
}

bool NestStorage::is_site(const LoopedFunc& f, const Loop& loop) const {
  return sites_.count(f.name() + "\n" + loop.var) > 0;
}

// Folds and leads are those of all places at which a Func is computed, so they are known last.
Stmt NestStorage::with_layouts(const Stmt& s) const {
  std::map<std::string, std::vector<Expr>> factors;
  for (const auto& [name, folds] : folds_) {
    if (std::ranges::none_of(folds, [](const Fold& fold) { return fold.factor.defined(); }))
      continue;
    factors[name] = factors[place_name(name)] = mapped(folds, &Fold::factor);
  }
  if (factors.empty() && leads_.empty()) return s;
  return rewrite_statements(s, [&](const Stmt& part, auto& all) {
    const Realize* n = part.as<Realize>();
    if (!n) return all.children(part);
    StorageLayout layout = n->layout;
    layout.folds = value_or(factors, n->name, {});
    layout.lead = value_or(leads_, n->name, 1);
    return make_realize(n->name, n->types, n->memory, n->bounds, all(n->body), layout);
  });
}

Stmt NestStorage::fold(const LoopedFunc& f, const Box& touched, const std::vector<Loop>& loops,
                       const std::vector<Slide>& slides, bool is_vectorized, ComputePlace& site,
                       Stmt stmt) {
  std::vector<FoldingLoop> windows;
  if (folds_any_ && !loops.empty()) {
    windows.push_back({loops[0], site.touched(touched)});
    Box whole = site.whole(touched);
    for (size_t i = 1; i < loops.size(); i++) {
      whole = ranged_over({loops[i - 1]}, std::move(whole));
      windows.push_back({loops[i], whole});
    }
  }
  std::vector<Fold> folds = folds_of(f, windows, slides, site.around, is_vectorized);
  for (size_t d = 0; d < folds.size(); d++) {
    if (folds[d].touched.defined())
      stmt =
          make_block({fold_check(f, static_cast<int>(d), folds[d].touched, folds[d].factor), stmt});
  }
  note_folds(f, std::move(folds));
  return stmt;
}

// Along one loop, a sliding window computes each value once, into an element of its own. The producer may then run
// ahead of its consumer as far as the storage allows: in storage folded to F coordinates, of which an iteration
// accesses W and computes S, by (F - W) / S further iterations. Under several loops, the window starts again in each
// iteration of the outer ones and overwrites elements that the consumer may still read. This is harmless only if
// nothing is folded and the same value is written; an update definition writes other values in between.
void NestStorage::note_lead(const LoopedFunc& f, const std::vector<Loop>& loops,
                            const std::vector<Slide>& slides, const Box& touched) {
  const std::vector<Fold>& folds = folds_.at(f.name());
  const bool is_folded =
      std::ranges::any_of(folds, [](const Fold& fold) { return fold.factor.defined(); });
  const bool is_computed_once = !slides.empty() && loops.size() == 1;
  const bool keeps_values = !slides.empty() && !is_folded && f.stages.size() == 1;
  int room = is_computed_once ? room_in_folds(folds, slides, touched) : keeps_values ? 0 : 1;
  auto [it, is_first] = leads_.emplace(f.name(), room);
  if (!is_first && (it->second == 0 || (room != 0 && room < it->second))) it->second = room;
}

// A dimension of a Func that is computed at several places folds only if all of them allow it.
void NestStorage::note_folds(const LoopedFunc& f, std::vector<Fold> folds) {
  auto [it, is_first] = folds_.emplace(f.name(), folds);
  for (size_t d = 0; d < folds.size() && !is_first; d++) {
    Expr& factor = it->second[d].factor;
    if (factor.defined() && folds[d].factor.defined()) {
      factor = simplify(max(factor, folds[d].factor));
    } else {
      factor = Expr();
    }
  }
}

Stmt NestStorage::realize(const LoopedFunc& f, const Box& box, Stmt stmt) {
  std::vector<Range> ranges;
  std::vector<Stmt> checks;
  for (size_t d = 0; d < box.size(); d++) {
    Range range{box[d].min, simplify(box[d].max - box[d].min + 1)};
    Expr& factor = folds_.at(f.name())[d].factor;
    auto extent = as_const_int(range.extent), fold = as_const_int(factor.defined() ? factor : 0);
    if (extent && fold && *extent <= *fold) factor = Expr();  // folding would save nothing
    if (const StorageRule* rule = rule_of(f, d)) apply(*rule, f, d, range, factor, checks);
    ranges.push_back(range);
  }
  StorageLayout layout;
  layout.order = storage_order(f);
  if (is_hoisted(f)) layout.place = place_name(f.name());
  checks.push_back(
      make_realize(f.name(), f.func->types, f.schedule.memory, ranges, stmt, std::move(layout)));
  return make_block(checks);
}

void NestStorage::note_place(const LoopedFunc& f, const Box& box,
                             std::map<std::string, Box>& storage) const {
  if (!is_hoisted(f)) return;
  Box room;
  for (size_t d = 0; d < box.size(); d++) {
    Expr extent = box[d].max - box[d].min + 1;
    if (const StorageRule* rule = rule_of(f, d)) {
      if (rule->bound.defined()) extent = rule->bound;
      if (rule->alignment.defined())
        extent = (extent + rule->alignment - 1) / rule->alignment * rule->alignment;
      if (rule->fold.defined()) extent = max(extent, rule->fold);
    }
    room.push_back({0, simplify(extent - 1)});
  }
  Box& place = storage[place_name(f.name())];
  place = hull(place, room);
}

const LoopedFunc* NestStorage::stored_func(const std::string& name) const {
  const LoopedFunc* f = program_.find(name);
  return f ? f : program_.find(name.substr(0, name.rfind('.')));
}

Stmt NestStorage::realize_stored(Emitted& code,
                                 const std::function<bool(const LoopLevel&)>& is_here) {
  Stmt stmt = code.stmt;
  for (auto it = code.storage.begin(); it != code.storage.end();) {
    const LoopedFunc& f = *stored_func(it->first);
    const bool is_place = f.name() != it->first;
    if (is_here(is_place ? f.schedule.hoist_level : f.schedule.store_level)) {
      if (!is_place) note_place(f, it->second, code.storage);
      Box box = simplified(it->second);
      stmt = is_place ? realize_place(f, box, stmt) : realize(f, box, stmt);
      it = code.storage.erase(it);
    } else {
      ++it;
    }
  }
  return stmt;
}

}  // namespace retrograde::lower
