// inline_reductions.cpp -- finds the domain of an inline reduction and the arguments of its Func, and defines the Func.
#include "frontend/language/inline_reductions.h"

#include <unordered_set>

#include "frontend/language/integer_ops.h"
#include "graph/definitions/define.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde {

namespace {

using DomainPtr = std::shared_ptr<graph::ReductionDomainContents>;

// The parts of an inline reduction.
struct Reduction {
  DomainPtr domain;
  Expr body;               // over `args` and the variables of the domain
  std::vector<Expr> args;  // arguments of the new Func
  std::vector<Expr> at;    // the values that the enclosing expression passes for them
};

class Finder {
 public:
  Finder(DomainPtr domain, std::string name) : domain_(std::move(domain)), name_(std::move(name)) {}

  Reduction find(const Expr& e) {
    if (!e.defined())
      user_error("reduce with " + name_, "the expression must be defined", "it was never assigned",
                 "Assign the Expr before its use");
    collect(e);
    if (!domain_) choose_domain();
    if (domain_->predicate.defined()) collect(domain_->predicate);
    Reduction result;
    result.domain = domain_;
    for (const ir::Variable* v : free_) add_argument(*v, result);
    result.body = ir::substitute(e, renamed_);
    return result;
  }

 private:
  DomainPtr domain_;
  std::string name_;
  std::vector<const ir::Variable*> free_;
  std::unordered_set<std::string> seen_;
  std::unordered_set<std::string> let_bound_;
  ir::Substitution renamed_;

  void collect(const Expr& root) {
    ir::walk(
        root, [&](const ir::Let& let) { let_bound_.insert(let.name); },
        [&](const ir::Variable& v) {
          if (seen_.insert(v.name).second) free_.push_back(&v);
        });
  }

  void choose_domain() {
    for (const ir::Variable* v : free_) {
      DomainPtr domain = graph::domain_of(*v);
      if (!domain) continue;
      if (domain_ && domain != domain_) {
        user_error("reduce with " + name_, "it runs over one RDom",
                   text("the expression uses ", quoted(domain_->vars[0].var), " and ",
                        quoted(domain->vars[0].var), " of different RDoms"),
                   "Name the one to reduce over: " + name_ +
                       "(r, ...). If the other one counts the steps of a recurrence, make each "
                       "step a Func of its own instead");
      }
      domain_ = domain;
    }
    if (!domain_) {
      user_error("reduce with " + name_, "the expression must use a reduction variable",
                 "it uses none", "Use an RDom inside, or name one: " + name_ + "(r, ...)");
    }
  }

  void add_argument(const ir::Variable& v, Reduction& result) {
    if (let_bound_.count(v.name)) return;
    const DomainPtr domain = graph::domain_of(v);
    if (domain == domain_ && domain) return;
    if (!v.symbol.defined()) {
      result.args.push_back(ir::variable(v.name));
      result.at.push_back(Expr(&v));
    } else if (domain) {
      // A variable of an enclosing reduction is a fixed value here, passed as an argument.
      const Var fresh;
      renamed_[v.name] = fresh;
      result.args.push_back(fresh);
      result.at.push_back(ir::loose_variable(v.name, v.type, v.symbol));
    }
  }
};

Reduction find_reduction(const DomainPtr& domain, const Expr& e, const char* name) {
  return Finder(domain, name).find(e);
}

void check_undefined(const Func& f, const char* name) {
  if (!f.defined()) return;
  user_error(text("reduce with ", name, " into ", quoted(f.name())),
             "the Func that is given must have no definition", "it has one", "Give a new Func");
}

// The update runs over the whole domain, even if the body uses only some of its variables, or none.
void update(const Func& f, const Reduction& reduction, const std::vector<Expr>& values) {
  graph::define_update(f.function(), reduction.args, values, reduction.domain);
}

// The initial value of a reduction, and the function that combines it with another value.
struct Fold {
  Expr (*initial)(Type);
  Expr (*combine)(Expr, Expr);
};
constexpr Fold sum_fold{ir::make_zero, [](Expr a, Expr b) { return a + b; }};
constexpr Fold saturating_fold{ir::make_zero, [](Expr a, Expr b) { return saturating_add(a, b); }};
constexpr Fold product_fold{ir::make_one, [](Expr a, Expr b) { return a * b; }};
constexpr Fold maximum_fold{[](Type type) { return Expr(type.min()); },
                            [](Expr a, Expr b) { return max(a, b); }};
constexpr Fold minimum_fold{[](Type type) { return Expr(type.max()); },
                            [](Expr a, Expr b) { return min(a, b); }};

Expr reduce(const Fold& fold, const DomainPtr& domain, const Expr& e, const Func& f,
            const char* name) {
  check_undefined(f, name);
  const Reduction reduction = find_reduction(domain, e, name);
  f(reduction.args) = fold.initial(e.type());
  update(f, reduction, {fold.combine(f(reduction.args), reduction.body)});
  return f(reduction.at);
}

// The result holds the coordinates, then the value. Only a strictly better element replaces the best so far.
Tuple reduce_place(bool is_max, const DomainPtr& domain, const Expr& e, const Func& f,
                   const char* name) {
  check_undefined(f, name);
  const Reduction reduction = find_reduction(domain, e, name);
  std::vector<Expr> initial, found;
  for (size_t i = 0; i < reduction.domain->vars.size(); i++) {
    initial.push_back(0);
    found.push_back(RVar(reduction.domain, static_cast<int>(i)));
  }
  initial.push_back(is_max ? e.type().min() : e.type().max());
  found.push_back(reduction.body);
  f(reduction.args) = Tuple(initial);
  const Tuple best = f(reduction.args);
  const Expr best_value = best[best.size() - 1];
  const Expr better = is_max ? reduction.body > best_value : reduction.body < best_value;
  update(f, reduction, select(better, Tuple(found), best).as_vector());
  return f(reduction.at);
}

}  // namespace

#define RETROGRADE_DEFINE_REDUCTION(Result, name, function, kind)                           \
  Result name(Expr e, const std::string& func_name) {                                       \
    return function(kind, nullptr, e, Func(func_name), #name);                              \
  }                                                                                         \
  Result name(const RDom& domain, Expr e, const std::string& func_name) {                   \
    return function(kind, domain.domain(), e, Func(func_name), #name);                      \
  }                                                                                         \
  Result name(Expr e, const Func& func) { return function(kind, nullptr, e, func, #name); } \
  Result name(const RDom& domain, Expr e, const Func& func) {                               \
    return function(kind, domain.domain(), e, func, #name);                                 \
  }
RETROGRADE_DEFINE_REDUCTION(Expr, sum, reduce, sum_fold)
RETROGRADE_DEFINE_REDUCTION(Expr, saturating_sum, reduce, saturating_fold)
RETROGRADE_DEFINE_REDUCTION(Expr, product, reduce, product_fold)
RETROGRADE_DEFINE_REDUCTION(Expr, maximum, reduce, maximum_fold)
RETROGRADE_DEFINE_REDUCTION(Expr, minimum, reduce, minimum_fold)
RETROGRADE_DEFINE_REDUCTION(Tuple, argmax, reduce_place, true)
RETROGRADE_DEFINE_REDUCTION(Tuple, argmin, reduce_place, false)
#undef RETROGRADE_DEFINE_REDUCTION

}  // namespace retrograde
