#include "autodiff/inversion/narrow_reductions.h"

#include <optional>
#include <unordered_set>

#include "analysis/linear.h"
#include "autodiff/updates/update_context.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

class Narrower {
 public:
  Narrower(Gather& g, const std::vector<std::string>& target_args) : g_(g) {
    variables_.insert(target_args.begin(), target_args.end());
    for (const ReductionVariable& r : g.rdom->vars) variables_.insert(r.var);
  }

  void run() {
    std::vector<Expr> terms, rest;
    add_conjuncts(g_.predicate, terms);
    for (const Expr& term : terms) {
      if (!becomes_an_end(term)) rest.push_back(term);
    }
    g_.predicate = rest.empty() ? Expr() : conjunction(rest);
  }

 private:
  bool becomes_an_end(const Expr& condition) {
    std::optional<Sum> form = nonnegative_where(condition);
    if (!form) return false;
    for (ReductionVariable& r : g_.rdom->vars) {
      const int64_t c = form->factor_of(r.var);
      if (c != 1 && c != -1) continue;
      Expr end = end_of(*form, r, c);
      if (as_const_int(r.extent) || !end.defined()) return false;
      c == 1 ? raise_min(r, end) : lower_max(r, end);
      return true;
    }
    return false;
  }
  // The end of r in c * r + rest >= 0; undefined if the rest varies within the loop.
  Expr end_of(const Sum& form, const ReductionVariable& r, int64_t c) const {
    Expr end = to_expr(times(plus(form, linear_sum(variable(r.var), c), -1), -c));
    return !end.defined() || uses_any_variable(end, variables_) || depends_on_data(end) ? Expr()
                                                                                        : end;
  }

  static void raise_min(ReductionVariable& r, const Expr& end) {
    Expr last = r.min + r.extent - 1;
    r.min = simplify(max(r.min, end));
    r.extent = simplify(last - r.min + 1);
  }
  static void lower_max(ReductionVariable& r, const Expr& end) {
    r.extent = simplify(min(r.min + r.extent - 1, end) - r.min + 1);
  }

  Gather& g_;
  std::unordered_set<std::string> variables_;  // not allowed in the bounds of a loop
};

}  // namespace

void narrow_reductions(Gather& g, const std::vector<std::string>& target_args) {
  if (g.rdom && g.predicate.defined()) Narrower(g, target_args).run();
}

}  // namespace retrograde::autodiff
