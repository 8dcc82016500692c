#include "lower/nests/shared_loops.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

bool is_known(ComputePlace& home, const Expr& condition) {
  return can_prove(home.without_names(condition));
}

Expr smaller(ComputePlace& home, const Expr& a, const Expr& b) {
  if (equal(a, b)) return a;
  if (is_known(home, a <= b)) return a;
  return is_known(home, b <= a) ? b : simplify(min(a, b));
}

Expr larger(ComputePlace& home, const Expr& a, const Expr& b) {
  if (equal(a, b)) return a;
  if (is_known(home, a >= b)) return a;
  return is_known(home, b >= a) ? b : simplify(max(a, b));
}

Interval shifted(const Interval& range, const Expr& shift) {
  return {simplify(range.min - shift), simplify(range.max - shift)};
}

// Adds the conditions under which a loop variable that runs over `all` lies in its own range.
void add_conditions(ComputePlace& home, const Expr& value, const Interval& own, const Interval& all,
                    std::vector<Expr>& conditions) {
  if (!equal(own.min, all.min) && !is_known(home, own.min <= all.min))
    conditions.push_back(likely(value >= own.min));
  if (!equal(own.max, all.max) && !is_known(home, own.max >= all.max))
    conditions.push_back(likely(value <= own.max));
}

Loop& loop_from_inside(std::vector<Loop>& loops, int depth) { return loops[loops.size() - depth]; }

// One of the two stages that are joined.
struct Side {
  std::vector<Loop> loops;       // as the stage would have them alone, outermost first
  std::vector<Expr> at;          // their variables in terms of the shared loops
  std::vector<Expr> conditions;  // under which the stage runs
};

Strand strand_of(const Needs& needs, const Side& side) { return {needs, side.loops, side.at}; }

Substitution values_of(const Side& side) {
  Substitution values;
  for (size_t d = 0; d < side.loops.size(); d++) values[side.loops[d].name] = side.at[d];
  return values;
}

Box substituted(const Box& box, const Substitution& values) {
  Box result = box;
  for (Interval& end : result) {
    if (end.min.defined()) end.min = simplify(substitute(end.min, values));
    if (end.max.defined()) end.max = simplify(substitute(end.max, values));
  }
  return result;
}

// Adds the needs of one side as a strand, or, if it always runs, to the common needs.
void add_needs(Emitted& code, Needs needs, const Side& side) {
  if (!side.conditions.empty()) {
    code.strands.push_back(strand_of(needs, side));
    return;
  }
  range_over_loops(needs);
  const Substitution values = values_of(side);
  map_boxes(needs, [&](const Box& box) { return substituted(box, values); });
  merge_needs(code, needs);
}

// Binds the loop variables of the joining side, which its statement uses.
Stmt with_variables(Stmt stmt, const Side& side) {
  for (size_t d = side.loops.size(); d-- > 0;)
    stmt = make_let(side.loops[d].name, side.at[d], stmt);
  return stmt;
}

Stmt guarded(const Side& side, const Stmt& stmt) {
  return side.conditions.empty() ? stmt : make_if(conjunction(side.conditions), stmt);
}

}  // namespace

void join(Emitted& code, SharedLoops around, Emitted other, const std::vector<Loop>& other_loops,
          const std::vector<Expr>& shift, int depth) {
  RETROGRADE_ASSERT(code.lead == 0 && other.lead == 0, "shared loops that began early inside");
  Side host, guest;
  for (int d = 1; d <= depth; d++) {
    Loop& loop = loop_from_inside(around.loops, d);
    const Loop& joining = other_loops[other_loops.size() - d];
    const Interval own = loop.range(), theirs = shifted(joining.range(), shift[d - 1]);
    const Interval all{smaller(around.home, own.min, theirs.min),
                       larger(around.home, own.max, theirs.max)};
    const Expr var = variable(loop.name);
    host.loops.push_back(loop);
    host.at.push_back(var);
    guest.loops.push_back(joining);
    guest.at.push_back(simplify(var + shift[d - 1]));
    add_conditions(around.home, var, own, all, host.conditions);
    add_conditions(around.home, var, theirs, all, guest.conditions);
    loop.min = all.min;
    loop.extent = simplify(all.max - all.min + 1);
  }
  Needs hosts = std::move(static_cast<Needs&>(code)),
        guests = std::move(static_cast<Needs&>(other));
  static_cast<Needs&>(code) = {};
  add_needs(code, std::move(hosts), host);
  add_needs(code, std::move(guests), guest);
  const Substitution values = values_of(guest);
  for (Strand& strand : other.strands) {
    for (Expr& at : strand.at) at = simplify(substitute(at, values));
    code.strands.push_back(std::move(strand));
  }
  code.stmt =
      make_block({guarded(host, code.stmt), guarded(guest, with_variables(other.stmt, guest))});
  code.has_loops |= other.has_loops;
  code.has_vectors |= other.has_vectors;
}

namespace {

// A strand's loop variables in terms of the shared loops: their values where its stage runs, and the values clamped to
// their ranges.
struct InLoops {
  Substitution values, inside;
  std::vector<Expr> conditions;
};

InLoops in_loops(const Strand& strand, SharedLoops around, size_t inner) {
  Substitution first, last;
  for (size_t i = inner; i < around.loops.size(); i++) {
    const Interval all = around.loops[i].range();
    first[around.loops[i].name] = all.min;
    last[around.loops[i].name] = all.max;
  }
  InLoops result;
  for (size_t d = 0; d < strand.loops.size(); d++) {
    Expr value = strand.at[d];
    const Interval own = strand.loops[d].range();
    const Interval all{substitute(value, first), substitute(value, last)};
    result.values[strand.loops[d].name] = value;
    add_conditions(around.home, value, own, all, result.conditions);
    if (!is_known(around.home, own.max >= all.max)) value = min(value, own.max);
    if (!is_known(around.home, own.min <= all.min)) value = max(value, own.min);
    result.inside[strand.loops[d].name] = simplify(value);
  }
  return result;
}

// The hull of the boxes whose condition holds. If none holds, any box inside of the needed region is correct.
class ConditionalHull {
 public:
  // `inside`: the box, clamped to its stage's range for iterations in which the stage does not run.
  void add(const Expr& runs, const Box& box, const Box& inside) {
    if (hull_.empty()) {
      hull_ = box;
      always_ = inside;
      runs_ = runs;
      return;
    }
    const Box both = hull(hull_, box);
    for (size_t d = 0; d < hull_.size(); d++) {
      add_end(runs, box[d].min, both[d].min, hull_[d].min, always_[d].min);
      add_end(runs, box[d].max, both[d].max, hull_[d].max, always_[d].max);
    }
    runs_ = simplify(runs_ || runs);
  }
  const Box& box() const { return always_; }

 private:
  Box hull_;    // where at least one stage runs
  Box always_;  // the same, and a valid box where none runs
  Expr runs_;   // whether at least one runs

  void add_end(const Expr& runs, const Expr& end, const Expr& both, Expr& hull_end,
               Expr& always_end) const {
    if (!both.defined()) {
      hull_end = always_end = both;
      return;
    }
    const Expr here = choose(runs_, both, end);
    hull_end = choose(runs, here, hull_end);
    always_end = choose(runs, here, always_end);
  }
  static Expr choose(const Expr& condition, const Expr& a, const Expr& b) {
    const bool either = is_const_true(condition) || is_zero(simplify(a - b));
    return either ? a : simplify(select(condition, a, b));
  }
};

}  // namespace

void gather_uses(Emitted& code, SharedLoops around, size_t inner,
                 const std::vector<std::string>& names,
                 const std::function<bool(const std::string&)>& keeps_moving) {
  std::map<std::string, ConditionalHull> hulls;
  Requirements found;
  for (Strand& strand : code.strands) {
    if (std::none_of(names.begin(), names.end(),
                     [&](const std::string& name) { return strand.uses.count(name); }))
      continue;
    range_over_loops(strand);
    const InLoops here = in_loops(strand, around, inner);
    const Expr runs = conjunction(here.conditions);
    for (const std::string& name : names) {
      const auto use = strand.uses.find(name);
      if (use == strand.uses.end()) continue;
      const Box inside = substituted(use->second.box, here.inside);
      if (keeps_moving(name)) {
        hulls[name].add(const_true(), inside, inside);
      } else {
        hulls[name].add(runs, substituted(use->second.box, here.values), inside);
      }
      found.emplace(name, use->second);
      strand.uses.erase(use);
    }
  }
  range_over_loops(code);
  for (auto& [name, use] : found) {
    if (auto own = code.uses.find(name); own != code.uses.end())
      hulls[name].add(const_true(), own->second.box, own->second.box);
    use.box = hulls[name].box();
    code.uses[name] = use;
  }
}

void gather_boxes(Emitted& code, SharedLoops around, size_t inner,
                  std::map<std::string, Box> Needs::*boxes,
                  const std::function<bool(const std::string&)>& is_wanted) {
  range_over_loops(code);
  for (Strand& strand : code.strands) {
    if ((strand.*boxes).empty()) continue;
    range_over_loops(strand);
    const InLoops here = in_loops(strand, around, inner);
    std::erase_if(strand.*boxes, [&](const auto& entry) {
      if (!is_wanted(entry.first)) return false;
      Box& box = (code.*boxes)[entry.first];
      box = hull(box, substituted(entry.second, here.inside));
      return true;
    });
  }
}

void merge_strands(Emitted& code) {
  range_over_loops(code);
  for (Strand& strand : code.strands) {
    range_over_loops(strand);
    merge_needs(code, strand);
  }
  code.strands.clear();
}

}  // namespace retrograde::lower
