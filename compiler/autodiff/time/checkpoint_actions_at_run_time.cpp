// Computes the table of checkpoint_actions.h at run time, by a Func.
#include <algorithm>

#include "autodiff/sums/generated_definitions.h"
#include "autodiff/time/checkpoint_actions.h"
#include "autodiff/time/revolve.h"
#include "diagnostics/error.h"
#include "frontend/data/buffer.h"
#include "graph/definitions/define.h"
#include "graph/function.h"
#include "ir/build.h"

namespace retrograde::autodiff {

namespace {

// Expressions in a number of steps between 0 and most_steps_at_run_time.
class BinomialBound {
 public:
  BinomialBound(const Expr& steps, int states)
      : steps_(steps), states_(states), most_(most_steps_at_run_time(states)) {
    if (states == 1) return;
    while (revolve_steps_within(states, repetitions_) < most_) ++repetitions_;
  }

  // The least r with steps <= C(s + r, s).
  Expr repetitions() const {
    if (states_ == 1) return steps_ - 1;
    return by_repetitions([](int r) { return make_const(Int(32), r); });
  }
  // The number of recomputed steps: r n - C(s + r, s + 1).
  Expr advances() const {
    if (states_ == 1) return steps_ * (steps_ - 1) / 2;
    return by_repetitions([&](int r) {
      return steps_ * r - make_const(Int(32), r > 0 ? revolve_steps_within(states_ + 1, r - 1) : 0);
    });
  }
  // A table of C(S + R, S) at (S, R), for all S and R that occur. Not used with a single state.
  Buffer<int> binomials() const {
    Buffer<int> table(states_ + 1, repetitions_ + 1);
    for (int r = 0; r <= repetitions_; ++r) {
      for (int s = 0; s <= states_; ++s)
        table(s, r) = static_cast<int>(std::min<int64_t>(revolve_steps_within(s, r), 1 << 30));
    }
    return table;
  }

 private:
  template <typename Leaf>
  Expr by_repetitions(const Leaf& leaf) const {
    return choose(0, repetitions_, leaf);
  }
  // leaf(r) for the least sufficient r in [first, last].
  template <typename Leaf>
  Expr choose(int first, int last, const Leaf& leaf) const {
    if (first == last) return leaf(first);
    int middle = (first + last) / 2;
    Expr enough = steps_ <= static_cast<int>(revolve_steps_within(states_, middle));
    return make_select(enough, choose(first, middle, leaf), choose(middle + 1, last, leaf));
  }

  Expr steps_;
  int states_, most_, repetitions_ = 0;
};

struct Triple {
  Expr a, b, c;
};
Triple choose(const Expr& condition, const Triple& x, const Triple& y) {
  return {select(condition, x.a, y.a), select(condition, x.b, y.b), select(condition, x.c, y.c)};
}

class ActionsFunc {
 public:
  ActionsFunc(const Expr& steps, int states, const std::string& name)
      : states_(states),
        steps_(clamp(steps, 0, most_steps_at_run_time(states))),
        bound_(steps_, states),
        func_(make_func(Role::CheckpointPlan)) {
    func_->name = name;
    // Reversing a step takes two rows. Of n frames, all except the first restore a state, and at most all store one.
    rows_ = max(bound_.advances() + steps_ * 4 - 1, 0);
    define_start(steps);
    append_loop();
  }

  ActionTable table() const {
    ActionTable result;
    result.rows = rows_;
    result.computed_by = func_;
    result.entry = [func = func_, first = frames()](int column, const Expr& row) {
      return call_value(func, {row + first}, column);
    };
    Expr again = steps_ * variable("r");  // an upper bound, for cost estimates
    result.counts = {steps_, steps_, again, steps_, steps_};
    return result;
  }

 private:
  int frames() const { return states_ + 1; }
  static Expr code(Action action) { return Expr(static_cast<int>(action)); }

  void define_start(const Expr& asked) {
    Expr p = variable("p"), is_root = p == 0, is_row = p == frames();
    int most = most_steps_at_run_time(states_);
    std::string rule =
        text("a loop with room for ", states_, states_ == 1 ? " kept state" : " kept states",
             " has at most ", most, " steps, this one has");
    Expr checked = require(asked <= most, steps_, rule, asked,
                           "; give a larger budget: AdjointOptions::checkpoint_states");
    Triple root{0, checked, bound_.repetitions()};
    Triple row{select(steps_ > 1, code(Action::Store), code(Action::Record)), 0, 0};
    Triple start = choose(is_root, root, choose(is_row, row, {code(Action::Idle), 0, 0}));
    define_pure(func_, {p}, {start.a, start.b, start.c});
  }

  Triple at(const Expr& place) const {
    return {call_value(func_, {place}, 0), call_value(func_, {place}, 1),
            call_value(func_, {place}, 2)};
  }
  Triple frame(const Expr& depth) const { return at(clamp(depth, 0, states_)); }

  // Iteration i runs after row i. If its step is the last one before the cut, the steps after the cut become a frame of
  // their own, one level deeper. Then it appends row i + 1.
  void append_loop() {
    const DomainPtr rdom = make_domain();
    Expr write = add_loop(rdom, "write", make_zero(Int(32)), make_const(Int(32), 3));
    Expr i = add_loop(rdom, "row", make_zero(Int(32)), max(rows_ - 1, 0));

    Triple row = at(i + frames());
    const Expr &depth = row.c, &step = row.b;
    Triple now = frame(depth);
    Expr cut = middle(now, states_ - depth);
    Triple behind{cut, now.b, now.c}, before{now.a, cut, now.c - 1};
    Triple value = choose(write == 0, behind, choose(write == 1, before, next_row(row, now)));
    Expr place = select(write == 0, clamp(depth + 1, 0, states_), write == 1,
                        clamp(depth, 0, states_), i + (frames() + 1));
    Expr cuts = row.a == code(Action::Advance) && step + 1 == cut;
    append_update(func_, {place}, {value.a, value.b, value.c}, rdom->vars, write == 2 || cuts);
  }

  // Where a frame is cut: first_part of revolve.cpp.
  Expr middle(const Triple& frame, const Expr& states) const {
    const Buffer<int> binomials = bound_.binomials();
    auto table = binomials.parameter();
    const int last = binomials.height() - 1;
    auto within = [&](const Expr& s) {
      return call_image(table->name, table->type,
                        {clamp(s, 0, states_), clamp(frame.c - 1, 0, last)}, SymbolRef(table));
    };
    Expr size = frame.b - frame.a;
    Expr first = min(within(states), size - within(states - 1));
    return frame.a + select(states <= 1, size - 1, first);
  }

  // `now`: the frame of the row, which already ends at the cut.
  Triple next_row(const Triple& row, const Triple& now) const {
    const Expr &step = row.b, &depth = row.c;
    Triple behind = frame(depth + 1);
    auto starts = [](const Triple& frame, Action otherwise) {
      return select(frame.b - frame.a == 1, code(Action::Record), code(otherwise));
    };
    Triple advanced =
        choose(step + 1 == now.b, {starts(behind, Action::Store), step + 1, depth + 1},
               {code(Action::Advance), step + 1, depth});
    Triple popped = choose(depth == 0, {code(Action::Idle), 0, 0},
                           {code(Action::Restore), frame(depth - 1).a, depth - 1});
    Triple restored{starts(now, Action::Advance), step, depth};
    auto is = [&](Action a) { return row.a == code(a); };
    return choose(
        is(Action::Advance), advanced,
        choose(is(Action::Adjoint), popped,
               choose(is(Action::Restore), restored,
                      choose(is(Action::Store), {code(Action::Advance), step, depth},
                             choose(is(Action::Record), {code(Action::Adjoint), step, depth},
                                    {code(Action::Idle), 0, 0})))));
  }

  int states_;
  Expr steps_;
  BinomialBound bound_;
  FuncPtr func_;
  Expr rows_;
};

}  // namespace

int most_steps_at_run_time(int states) {
  int64_t low = 1, high = most_rows;  // low steps fit, high steps do not
  while (high - low > 1) {
    int64_t middle = (low + high) / 2;
    (revolve_advances(middle, states) + 4 * middle <= most_rows ? low : high) = middle;
  }
  return static_cast<int>(low);
}

ActionTable action_table(const Expr& steps, int states, const std::string& name) {
  return ActionsFunc(steps, states, name).table();
}

}  // namespace retrograde::autodiff
