#include "autodiff/time/time_axis.h"

#include <algorithm>

#include "autodiff/updates/update_relations.h"
#include "frontend/language/expr_ops.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

class TimeAxisFinder {
 public:
  TimeAxisFinder(const UpdateContext& c, const std::vector<FuncPtr>& order)
      : c_(c), f_(c.f), order_(order), relations_(c.domain, c.write, c.pure) {}

  std::optional<TimeAxis> find() {
    if (!relations_.write_is_affine() || !relations_.predicate_is_affine()) return std::nullopt;
    if (!find_dimension() || !starts_before()) return std::nullopt;
    if (!find_reads() || !find_readers()) return std::nullopt;
    auto steps = as_const_int(simplify(time().extent));
    if (axis_.slots > most_slots || (steps && *steps < axis_.slots)) return std::nullopt;
    axis_.ever_written = ever_written();
    return axis_;
  }

 private:
  static constexpr int most_slots = 64;

  const ReductionVariable& time() const { return c_.definition.rvars.back(); }
  bool uses_loops(const Expr& e) const {
    return depends_on_data(e) || std::ranges::any_of(c_.domain.vars, [&](const LoopVariable& v) {
             return uses_variable(e, v.name);
           });
  }
  // sign * (a - b) if that is constant.
  std::optional<int64_t> steps_between(const Expr& a, const Expr& b) const {
    auto difference = as_const_int(simplify(a - b));
    return difference ? std::optional(*difference * axis_.sign) : std::nullopt;
  }

  Expr ever_written() const {
    std::vector<Expr> write = c_.write, point = c_.point;
    write[axis_.dim] = point[axis_.dim] = make_zero(Int(32));
    IterationDomain everywhere = c_.domain;  // unbounded in pure dimensions
    for (LoopVariable& v : everywhere.vars) {
      if (!v.is_reduction) v.min = v.max = Expr();
    }
    return simplify(UpdateRelations(everywhere, write, c_.pure).written(point));
  }

  // Finds the dimension that is written at time + constant or constant - time.
  bool find_dimension() {
    if (c_.domain.predicate.defined() && uses_variable(c_.domain.predicate, time().var))
      return false;
    std::vector<size_t> dims;
    for (size_t d = 0; d < c_.write.size(); ++d) {
      if (uses_variable(c_.write[d], time().var)) dims.push_back(d);
    }
    if (dims.size() != 1) return false;
    axis_.dim = dims[0];
    auto at = [&](const Expr& t) {
      return simplify(substitute(c_.write[axis_.dim], time().var, t));
    };
    Expr zero = at(make_zero(Int(32)));
    for (int sign : {1, -1}) {
      axis_.sign = sign;
      Expr t = variable(time().var);
      if (uses_loops(zero) || !can_prove(at(t) == zero + t * sign)) continue;
      axis_.first = at(time().min);
      axis_.last = at(time().min + (time().extent - 1));
      return true;
    }
    return false;
  }

  // Whether earlier updates write only times before the first step.
  bool starts_before() const {
    for (int s = 1; s < c_.query.stage; ++s) {
      auto before = steps_between(axis_.first, without_lets(f_->stage(s).args[axis_.dim]));
      if (!before || *before < 1) return false;
    }
    return true;
  }

  bool find_reads() {
    bool in_place = relations_.write_is_injective();
    for (const Expr& read : c_.self_reads()) {
      std::vector<Expr> args = as_call_of(read, f_)->args;
      auto lag = steps_between(c_.write[axis_.dim], args[axis_.dim]);
      auto relation = relations_.read(args);
      if (!lag || *lag < 0 || *lag > most_slots || !relation || !keeps_pure_dimensions(args))
        return false;
      args[axis_.dim] = c_.write[axis_.dim];
      if (static_cast<int>(*lag) > axis_.lag) {
        axis_.lag = static_cast<int>(*lag);
        in_place = relations_.write_is_injective();
      }
      if (static_cast<int>(*lag) == axis_.lag) in_place &= same_args(args, c_.write);
      axis_.in_slot.push_back(where_in_slot(*relation, static_cast<int>(*lag)));
    }
    axis_.slots = in_place ? axis_.lag : axis_.lag + 1;
    return axis_.lag > 0;
  }
  bool keeps_pure_dimensions(const std::vector<Expr>& args) const {
    for (size_t d = 0; d < args.size(); ++d) {
      if (c_.pure[d] && !equal(args[d], c_.write[d])) return false;
    }
    return true;
  }
  // The condition that the value read is in a slot: a step wrote it, or it was there at the start, for times before the
  // first step.
  Expr where_in_slot(const UpdateRelations::Read& read, int lag) {
    Expr at_start = variable(time().var) < simplify(time().min + lag);
    if (relations_.sees_new_unless(read, at_start)) return const_true();
    return lag > 0 ? at_start || read.sees_new_condition : read.sees_new_condition;
  }

  // Checks that other Funcs read only the last slots.
  bool find_readers() {
    int64_t window = 0;
    for (const FuncPtr& g : order_) {
      if (g.get() == f_) continue;
      for_each_expr(*g, [&](const Expr& e) { window = std::max(window, read_by(e)); });
    }
    if (window == 0 || window > most_slots) return false;
    // Slices from before the first step must be in a slot at the start.
    if (window > axis_.lag && !can_prove(time().extent >= static_cast<int>(window) - axis_.lag))
      return false;
    axis_.slots = std::max(axis_.slots, static_cast<int>(window));
    return true;
  }
  // The number of slices before the end that an expression reads.
  int64_t read_by(const Expr& e) const {
    int64_t window = 0;
    walk(e, [&](const Expr& node) {
      const Call* call = as_call_of(node, f_);
      if (!call) return true;
      auto back = steps_between(axis_.last, call->args[axis_.dim]);
      window = std::max(window, back && *back >= 0 ? *back + 1 : int64_t{most_slots} + 1);
      return true;
    });
    return window;
  }

  const UpdateContext& c_;
  FuncContents* f_;
  const std::vector<FuncPtr>& order_;
  UpdateRelations relations_;
  TimeAxis axis_;
};

}  // namespace

std::optional<TimeAxis> find_time_axis(const UpdateContext& c, const std::vector<FuncPtr>& order) {
  if (c.definition.rvars.empty() || !c.reads_self()) return std::nullopt;
  try {
    return TimeAxisFinder(c, order).find();
  } catch (const isl::exception&) {
    return std::nullopt;  // isl exceeded its budget
  }
}

}  // namespace retrograde::autodiff
