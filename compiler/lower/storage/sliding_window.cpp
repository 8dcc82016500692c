#include "lower/storage/sliding_window.h"

#include <optional>

#include "analysis/linear.h"
#include "analysis/monotonic.h"
#include "ir/build.h"
#include "ir/markers.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

BoundsMap facts_of(const std::vector<Loop>& loops) {
  BoundsMap facts;
  for (const Loop& loop : loops) {
    Interval range = loop.range();
    facts[loop.name] = {range.min, range.max};
  }
  return facts;
}

Interval held_from_first(const Interval& side, const Loop& loop) {
  const auto held = [&](const Expr& end) {
    if (!end.defined() || !uses_variable(end, loop.name)) return end;
    return simplify(substitute(end, loop.name, max(variable(loop.name), loop.min)));
  };
  return {held(side.min), held(side.max)};
}

namespace {

// Removes the promises of splits about loop variables. They do not hold in warm-up iterations, nor in the one before
// the first iteration, whose front is where the first part begins.
Interval without_promises(const Interval& part) {
  return {ir::without_promises(part.min), ir::without_promises(part.max)};
}

constexpr int longest_warm_up = 256;
constexpr int longest_reach = 16;   // of a first part that is worth a smaller window
constexpr int undecided_steps = 4;  // of a warm-up whose length is not known to be constant

bool can_slide_over(const Loop& loop) {
  return loop.runs == ForType::Serial || loop.runs == ForType::Unrolled;
}

// Whether every update writes, and reads of f itself, at the dimension's own variable only.
bool is_pure_in(const LoopedFunc& f, int d) {
  const std::string& var = f.func->args[d];
  auto is_var = [&](const Expr& e) { return e.as<Variable>() && e.as<Variable>()->name == var; };
  const auto reads_elsewhere = [&](const Call& call) {
    return call.call_type == CallType::Func && call.name == f.name() && !is_var(call.args[d]);
  };
  return std::all_of(f.stages.begin() + 1, f.stages.end(), [&](const Definition& update) {
    return is_var(update.args[d]) && !any_node(update, reads_elsewhere);
  });
}

class Slider {
 public:
  Slider(const LoopedFunc& f, const Box& box, const std::vector<Loop>& around)
      : f_(f), box_(box), slid_(box.size(), false), facts_(facts_of(around)) {}

  // Continues with the loops outside of `inner`, each iteration of which includes the warm-up of `inner`.
  void hold(const Loop& inner) {
    for (Interval& side : box_) side = held_from_first(side, inner);
  }

  std::optional<Slide> over(const Loop& loop, bool is_directly_around, int lead) {
    int d = only_moving_dimension(loop.name);
    if (d < 0 || slid_[d] || !is_pure_in(f_, d)) return {};
    Slide slide{d, loop, 0, box_[d], {}, {}};
    if (!moves_one_way(slide)) return {};
    if (!(is_directly_around && start_early(slide, lead)) &&
        !start_whole(slide, lead, is_directly_around))
      return {};
    if (!stays_inside(slide)) return {};
    slid_[d] = true;
    return slide;
  }

 private:
  const LoopedFunc& f_;
  Box box_;
  std::vector<bool> slid_;
  const BoundsMap facts_;

  // The front is the end in the direction of movement: an iteration adds the values beyond the front of the one before.
  bool is_upwards_ = true;
  Expr front_, back_;

  int only_moving_dimension(const std::string& loop) const {
    int found = -1;
    for (size_t d = 0; d < box_.size(); d++) {
      if (!uses_variable(box_[d].min, loop) && !uses_variable(box_[d].max, loop)) continue;
      if (found >= 0) return -1;
      found = static_cast<int>(d);
    }
    return found;
  }

  bool moves_one_way(const Slide& slide) {
    Monotonic min = monotonic(slide.whole.min, slide.loop.name);
    Monotonic max = monotonic(slide.whole.max, slide.loop.name);
    auto is = [&](Monotonic way) {
      return (min == way || min == Monotonic::Constant) &&
             (max == way || max == Monotonic::Constant);
    };
    is_upwards_ = is(Monotonic::Increasing);
    front_ = is_upwards_ ? slide.whole.max : slide.whole.min;
    back_ = is_upwards_ ? slide.whole.min : slide.whole.max;
    return is_upwards_ || is(Monotonic::Decreasing);
  }

  // The first coordinate that the iterations before `iteration` have not computed.
  Expr fresh_at(const Slide& slide, const Expr& iteration) const {
    Expr before = substitute(front_, slide.loop.name, simplify(iteration - 1));
    return is_upwards_ ? before + 1 : before - 1;
  }
  std::optional<int64_t> difference(const Expr& a, const Expr& b) const {
    Expr ahead = is_upwards_ ? a - b : b - a;
    return as_const_int(simplify(ir::without_promises(without_likely(ahead)), facts_));
  }

  // Whether an iteration shares no values with the one before, so that sliding saves nothing.
  bool never_overlaps(const Expr& fresh) const {
    Expr apart = is_upwards_ ? back_ >= fresh : back_ <= fresh;
    return can_prove(without_likely(apart), facts_);
  }
  bool has_no_gaps(const Expr& fresh) const {
    Expr touches = is_upwards_ ? back_ <= fresh : back_ >= fresh;
    return can_prove(without_likely(touches), facts_);
  }

  Interval from(const Expr& fresh) const {
    return is_upwards_ ? Interval{fresh, front_} : Interval{front_, fresh};
  }

  std::optional<Expr> fresh_part(const Slide& slide) const {
    Expr fresh = simplify(fresh_at(slide, variable(slide.loop.name)));
    if (never_overlaps(fresh)) return {};
    if (has_no_gaps(fresh)) return fresh;
    return simplify(is_upwards_ ? max(back_, fresh) : min(back_, fresh));
  }

  // Finds a lead for which the parts begin exactly where the first iteration's box does.
  bool start_early(Slide& slide, int lead) const {
    auto fresh = fresh_part(slide);
    if (!fresh) return false;
    const Expr first = substitute(back_, slide.loop.name, slide.loop.min);
    int undecided = 0;
    for (int k = lead; k <= lead + longest_warm_up; k++) {
      auto ahead = difference(fresh_at(slide, slide.loop.min - k), first);
      if (!ahead && ++undecided > undecided_steps) return false;
      if (ahead && *ahead < 0) return false;
      if (!ahead || *ahead > 0) continue;
      slide.lead = k;
      slide.part = slide.touched = without_promises(from(*fresh));
      return true;
    }
    return false;
  }

  // The front `lead` iterations before the first, and whether it is at `first` or beyond.
  Expr front_at(const Slide& slide, int lead) const {
    return substitute(front_, slide.loop.name, simplify(slide.loop.min - lead));
  }
  bool reaches(const Expr& front, const Expr& first) const {
    const Expr is_there = is_upwards_ ? front >= first : front <= first;
    return can_prove(ir::without_promises(without_likely(is_there)), facts_);
  }
  // Clamps may prevent the parts from beginning before the first iteration's box. Then the earliest iteration whose
  // front is not before the box has the fewest values to compute at once. Consumers that do not slide hold the front
  // where it is in the loop's first iteration; starting earlier then gains nothing.
  int earliest_start(const Slide& slide, int lead, const Expr& first) const {
    int k = lead;
    while (k < lead + longest_warm_up && difference(front_at(slide, k), first) != 0 &&
           difference(front_at(slide, k), front_at(slide, k + 1)) != 0 &&
           reaches(front_at(slide, k + 1), first))
      k++;
    return k;
  }

  // An upper bound on how far the first part begins behind its front. If a chain of Funcs stays inside an image, it is
  // one coordinate per Func behind this one at the border, and zero elsewhere.
  std::optional<int> reach_of_first_part(const Slide& slide, const Expr& first) const {
    const Expr front = front_at(slide, slide.lead);
    for (int reach = 0; reach <= longest_reach; reach++) {
      const Expr end = is_upwards_ ? first + reach : first - reach;
      if (reaches(end, front)) return reach;
    }
    return {};
  }
  Expr at_least_as_far_back(const Expr& fresh, int reach) const {
    const Expr behind = make_const(Int(32), reach);
    return simplify(is_upwards_ ? min(fresh, front_ - behind) : max(fresh, front_ + behind));
  }

  bool start_whole(Slide& slide, int lead, bool is_directly_around) const {
    auto fresh = fresh_part(slide);
    if (!fresh) return false;
    Expr first = simplify(substitute(back_, slide.loop.name, slide.loop.min));
    if (lead > 0 && !reaches(front_at(slide, lead), is_upwards_ ? first - 1 : first + 1))
      return false;
    slide.lead = is_directly_around ? earliest_start(slide, lead, first) : lead;
    slide.touched = slide.whole;
    if (slide.lead == 0)
      first = back_;
    else if (const auto reach = reach_of_first_part(slide, first))
      slide.touched = without_promises(from(at_least_as_far_back(*fresh, *reach)));
    const Expr start = simplify(slide.loop.min - slide.lead);
    const Expr is_first = variable(slide.loop.name) <= start;
    // Marked likely, so that partition_loops separates the first iteration.
    if (simplify(select(is_first, first, *fresh)).as<Select>()) fresh = likely(*fresh);
    slide.part = without_promises(from(select(is_first, first, *fresh)));
    return true;
  }

  // Whether the loops of every stage, over a part of this extent, write nothing outside of it.
  bool stays_inside(const Slide& slide) const {
    Expr extent = simplify(without_likely(slide.part.max - slide.part.min + 1));
    for (size_t s = 0; s < f_.stages.size(); s++) {
      Expr known =
          is_const(extent) ? extent : variable("part.extent") * alignment_of(f_, slide.dimension);
      if (!covers_exactly(f_, static_cast<int>(s), f_.func->args[slide.dimension], known))
        return false;
    }
    return true;
  }
};

}  // namespace

std::vector<Slide> slides_of(const LoopedFunc& f, const Box& box, const std::vector<Loop>& loops,
                             const std::vector<Loop>& around, int lead) {
  std::vector<Slide> slides;
  Slider slider(f, box, around);
  for (size_t i = 0; i < loops.size() && can_slide_over(loops[i]); i++) {
    const auto slide = slider.over(loops[i], i == 0, i == 0 ? lead : 0);
    if (slide) slides.push_back(*slide);
    if (i == 0 && (slide ? slide->lead : lead) > 0) slider.hold(loops[0]);
  }
  return slides;
}

}  // namespace retrograde::lower
