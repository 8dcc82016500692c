// stage.h -- the schedule of one definition: its loops.
//
// Directives change in which order and how the points of a definition are computed, never what is
// computed. A stage starts with one loop for each variable: the reduction variables innermost, in
// their order, then the pure variables. All directives name loops by Var or RVar and throw
// CompileError when that breaks a rule.
#pragma once

#include <string>
#include <type_traits>
#include <vector>

#include "frontend/function.h"
#include "frontend/rdom.h"
#include "frontend/var.h"

namespace retrograde {

class Func;

struct VarOrRVar {
  VarOrRVar(const Var& v) : var(v), is_rvar(false) {}
  VarOrRVar(const RVar& r) : rvar(r), is_rvar(true) {}
  VarOrRVar(const RDom& r) : rvar(RVar(r)), is_rvar(true) {}
  template <int N>
  VarOrRVar(const ImplicitVar<N>& v) : var(v.to_var()), is_rvar(false) {}
  VarOrRVar(const std::string& name, bool is_rvar) : var(name), rvar(name), is_rvar(is_rvar) {}
  const std::string& name() const { return is_rvar ? rvar.name() : var.name(); }

  Var var = Var("_");
  RVar rvar{"_"};
  bool is_rvar;
};

class Stage {
 public:
  Stage(ir::FuncPtr func, int index) : func_(std::move(func)), index_(index) {}

  // "blur", "blur.update(0)"
  std::string name() const;
  const ir::FuncPtr& function() const { return func_; }
  int index() const { return index_; }
  const ir::StageSchedule& get_schedule() const;
  std::string dump_argument_list() const;  // the loops, innermost first

  //   for x in [0, n):        for xo in [0, ceil(n / f)):
  //     body(x)          =>     for xi in [0, f):
  //                               body(xo * f + xi)
  Stage& split(const VarOrRVar& old, const VarOrRVar& outer, const VarOrRVar& inner,
               const Expr& factor, TailStrategy tail = TailStrategy::Auto);
  //   for y in [0, m):           for t in [0, n * m):
  //     for x in [0, n):    =>     body(t % n, t / n)
  //       body(x, y)
  Stage& fuse(const VarOrRVar& inner, const VarOrRVar& outer, const VarOrRVar& fused);
  Stage& rename(const VarOrRVar& old_name, const VarOrRVar& new_name);
  // Innermost first; loops that are not named keep their places.
  Stage& reorder(const std::vector<VarOrRVar>& vars);
  template <typename... Rest>
  requires((std::is_convertible_v<Rest, VarOrRVar> &&
            ...)) Stage& reorder(const VarOrRVar& x, const VarOrRVar& y, Rest&&... rest) {
    return reorder(std::vector<VarOrRVar>{x, y, VarOrRVar(std::forward<Rest>(rest))...});
  }

  Stage& serial(const VarOrRVar& var);
  Stage& parallel(const VarOrRVar& var);
  Stage& vectorize(const VarOrRVar& var);  // a loop of constant extent
  Stage& unroll(const VarOrRVar& var);     // a loop of constant extent
  // The same after a split; the outer loop keeps the name of `var`, except that a parallel loop is
  // the outer one.
  Stage& parallel(const VarOrRVar& var, const Expr& task_size,
                  TailStrategy tail = TailStrategy::Auto);
  Stage& vectorize(const VarOrRVar& var, const Expr& factor,
                   TailStrategy tail = TailStrategy::Auto);
  Stage& unroll(const VarOrRVar& var, const Expr& factor, TailStrategy tail = TailStrategy::Auto);

  // Splits both and runs block after block: loops xi, yi, xo, yo, innermost first.
  Stage& tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& xo, const VarOrRVar& yo,
              const VarOrRVar& xi, const VarOrRVar& yi, const Expr& xfactor, const Expr& yfactor,
              TailStrategy tail = TailStrategy::Auto);
  Stage& tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& xi, const VarOrRVar& yi,
              const Expr& xfactor, const Expr& yfactor, TailStrategy tail = TailStrategy::Auto);
  Stage& tile(const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& outers,
              const std::vector<VarOrRVar>& inners, const std::vector<Expr>& factors,
              const std::vector<TailStrategy>& tails);
  Stage& tile(const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& outers,
              const std::vector<VarOrRVar>& inners, const std::vector<Expr>& factors,
              TailStrategy tail = TailStrategy::Auto);
  Stage& tile(const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& inners,
              const std::vector<Expr>& factors, TailStrategy tail = TailStrategy::Auto);

  void unscheduled() {}  // says that no directive was forgotten

 private:
  ir::Definition& definition() const { return func_->stage(index_); }
  ir::StageSchedule& touch() const;
  size_t loop_index(const VarOrRVar& var, const std::string& asked) const;
  void check_new_name(const VarOrRVar& var, const std::string& replaced,
                      const std::string& asked) const;
  void check_race_free(const VarOrRVar& var, const std::string& asked) const;
  Stage& set_for_type(const VarOrRVar& var, ForType type, const char* verb);

  ir::FuncPtr func_;
  int index_;
};
using ScheduleHandle = Stage;

}  // namespace retrograde
