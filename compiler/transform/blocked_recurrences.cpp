#include "transform/blocked_recurrences.h"

#include <algorithm>
#include <optional>
#include <string>

#include "graph/definitions/define.h"
#include "graph/definitions/own_reads.h"
#include "graph/definitions/reduction_domain.h"
#include "graph/directives/directive.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"
#include "transform/linear_recurrences.h"
#include "transform/rewritable_updates.h"

namespace retrograde::transform {

namespace {

constexpr int block = 256;  // points
constexpr int64_t least_length = 16 * block;
constexpr int64_t most_signals = 4;

class RecurrenceBlockFinder {
 public:
  RecurrenceBlockFinder(const std::vector<FuncPtr>& outputs, SumOrder order)
      : rewritable_(outputs), order_(order) {}

  std::optional<LinearRecurrence> recurrence(const FuncContents& f, const Definition& update) {
    const bool may_reorder = f.made || order_ == SumOrder::Free;
    if (!may_reorder || update.rvars.size() != 1 ||
        !is_long(update.rvars[0].extent, least_length) ||
        !rewritable_.contain(f, update, most_signals))
      return std::nullopt;
    return linear_recurrence(f, update);
  }

 private:
  RewritableUpdates rewritable_;
  const SumOrder order_;
};

// The terms that an element adds to the ones after it: response(order - 1 - k + n, k) to the n-th after the element before a
// block, if the k-th before that is 1 and the others are 0.
FuncPtr make_response(const FuncContents& f, const LinearRecurrence& recurrence,
                      const std::vector<std::string>& signals) {
  const FuncPtr g = make_func(Role::SharedValue, f.name + "_response", f.name);
  const int order = recurrence.order();
  const Expr point = variable("point"), state = variable("state");
  std::vector<Expr> args{point, state};
  for (const std::string& signal : signals) args.push_back(variable(signal));
  define_pure(g, args,
              {make_select(point + state == order - 1, make_one(Float(64)), make_zero(Float(64)))});
  const DomainPtr domain = make_domain();
  const Expr n = add_loop(domain, "point", order, block);
  args[1] = add_loop(domain, "state", 0, order);
  Expr value;
  for (int k = 1; k <= order; ++k) {
    if (!recurrence.coefficients[k - 1].defined()) continue;
    args[0] = n - k;
    add_term(value, call_func(g->name, Float(64), args, 0, SymbolRef::weak(g)) *
                        recurrence.coefficients[k - 1]);
  }
  args[0] = n;
  define_update(g, args, {value}, domain);
  return g;
}

class Blocker {
 public:
  Blocker(const FuncPtr& f, const Definition& update, LinearRecurrence recurrence)
      : f_(f),
        update_(update),
        r_(update.rvars[0]),
        recurrence_(std::move(recurrence)),
        order_(recurrence_.order()) {
    const Interval& steady = recurrence_.steady;
    const Expr end = r_.min + max(r_.extent, 0);
    begin_ = simplify(steady.min.defined() ? clamp(steady.min, r_.min, end) : r_.min);
    const Expr after = steady.max.defined() ? end - clamp(steady.max + 1, begin_, end) : Expr(0);
    const Expr count = end - after - begin_;
    blocks_ = simplify(count / block);
    rest_ = simplify(count % block + after);
    for (size_t d = 0; d < f->args.size(); ++d) {
      const auto is_used = [&](const Expr& e) {
        return e.defined() && uses_variable(e, f->args[d]);
      };
      if (std::ranges::any_of(recurrence_.coefficients, is_used)) signals_.push_back(f->args[d]);
    }
    response_ = make_response(*f, recurrence_, signals_);
  }

  // The updates that replace it.
  std::vector<Definition> run() const {
    std::vector<Definition> result;
    add_part(r_.min, simplify(begin_ - r_.min), result);
    result.push_back(from_zeros());
    result.push_back(last_elements());
    result.push_back(other_elements());
    add_part(simplify(begin_ + blocks_ * block), rest_, result);
    return result;
  }

 private:
  // Iterations as they were.
  void add_part(const Expr& min, const Expr& extent, std::vector<Definition>& parts) const {
    if (is_zero(extent)) return;
    const DomainPtr domain = make_domain();
    const Expr r = add_loop(domain, graph::without_numbers(r_.var), min, extent);
    parts.push_back(definition(domain, args_at(r), at(r, update_.values[0])));
  }

  Definition from_zeros() const {
    const DomainPtr domain = make_domain();
    const Expr point = add_loop(domain, "point", 0, block);
    const Expr number = add_loop(domain, "block", 0, blocks_) * block;
    const Expr value = map_calls_of(
        recurrence_.value, f_.get(), [&](const Call& own, const std::vector<Expr>& args) -> Expr {
          const int64_t k = *iterations_before(update_, args);
          if (k == 0) return {};
          const auto lag = static_cast<int>(k);
          const Expr before = max(likely(point - lag), 0);
          return make_select(likely(point >= lag), own_element(begin_ + number + before),
                             make_zero(own.type));
        });
    const Expr r = begin_ + number + point;
    return definition(domain, args_at(r), at(r, value));
  }

  // The elements that the next block starts from.
  Definition last_elements() const {
    const DomainPtr domain = make_domain();
    const Expr last = add_loop(domain, "last", 0, order_);
    const Expr number = add_loop(domain, "block", 0, blocks_) * block;
    const Expr point = last + (block - order_);
    const Expr r = begin_ + number + point;
    Expr sum = cast_to(Float(64), own_element(r));
    for (int k = 0; k < order_; ++k)
      add_term(sum,
               call_op(Op::strong_mul, {cast_to(Float(64), state(number, k)), response(point, k)}));
    return definition(domain, args_at(r), cast_to(type(), sum));
  }

  Definition other_elements() const {
    const DomainPtr domain = make_domain();
    const Expr point = add_loop(domain, "point", 0, block - order_);
    const Expr number = add_loop(domain, "block", 0, blocks_) * block;
    const Expr r = begin_ + number + point;
    Expr sum = own_element(r);
    for (int k = 0; k < order_; ++k)
      add_term(sum,
               call_op(Op::strong_mul, {state(number, k), cast_to(type(), response(point, k))}));
    return definition(domain, args_at(r), sum);
  }

  Type type() const { return f_->types[0]; }

  Expr at(const Expr& r, const Expr& e) const { return substitute(e, {{r_.var, r}}); }
  std::vector<Expr> args_at(const Expr& r) const {
    return mapped(update_.args, [&](const Expr& arg) { return at(r, arg); });
  }
  Expr own_element(const Expr& r) const {
    return call_func(f_->name, type(), args_at(r), 0, SymbolRef::weak(f_));
  }
  // The element k + 1 before the block.
  Expr state(const Expr& number, int k) const { return own_element(begin_ + number - (k + 1)); }
  Expr response(const Expr& point, int k) const {
    std::vector<Expr> args{point + order_, Expr(k)};
    for (const std::string& signal : signals_) args.push_back(variable(signal));
    return call_func(response_->name, Float(64), args, 0, SymbolRef(response_));
  }

  Definition definition(const DomainPtr& domain, std::vector<Expr> args, const Expr& value) const {
    Definition result;
    result.args = std::move(args);
    result.values = {value};
    result.rvars = domain->vars;
    result.schedule.dims = graph::first_loops(*f_, result);
    return result;
  }

  const FuncPtr& f_;
  const Definition& update_;
  const ReductionVariable& r_;
  const LinearRecurrence recurrence_;
  const int order_;
  Expr begin_;                        // of the steady iterations
  Expr blocks_, rest_;                // whole blocks, and the iterations after them
  std::vector<std::string> signals_;  // variables that the coefficients depend on
  FuncPtr response_;
};

}  // namespace

bool has_blocked_recurrences(const std::vector<FuncPtr>& outputs, SumOrder order) {
  RecurrenceBlockFinder finder(outputs, order);
  return std::ranges::any_of(topological_order(outputs), [&](const FuncPtr& f) {
    return std::ranges::any_of(f->updates, [&](const Definition& update) {
      return finder.recurrence(*f, update).has_value();
    });
  });
}

void run_in_blocks(const std::vector<FuncPtr>& outputs, SumOrder order) {
  RecurrenceBlockFinder finder(outputs, order);
  for (const FuncPtr& f : topological_order(outputs)) {
    std::vector<Definition> updates;
    for (const Definition& update : f->updates) {
      auto recurrence = finder.recurrence(*f, update);
      if (recurrence)
        append(updates, Blocker(f, update, *std::move(recurrence)).run());
      else
        updates.push_back(update);
    }
    if (updates.size() == f->updates.size()) continue;
    f->updates = std::move(updates);
    ++f->version;
  }
}

}  // namespace retrograde::transform
