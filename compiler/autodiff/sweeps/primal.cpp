#include "autodiff/sweeps/primal.h"

#include "autodiff/rules/derivative_rules.h"
#include "autodiff/sweeps/input_shape.h"
#include "autodiff/updates/update_context.h"
#include "ir/build.h"

namespace retrograde::autodiff {

Primal::Primal(const Seeds& seeds, const SynthesisOptions& options)
    : seeds(seeds),
      options(options),
      outputs(outputs_of(seeds)),
      order(topological_order(outputs)),
      regions(order, regions_of(seeds)),
      ranges(order),
      active(outputs, order, options) {}

AdjointTarget Primal::target_of(const Symbol* symbol) const {
  const auto* f = dynamic_cast<const FuncContents*>(symbol);
  const InputShape shape = shape_of(symbol);
  const std::vector<std::string> args = f ? f->args : implicit_names(shape.dimensions);
  return {shape.name, args, mapped(shape.types, adjoint_type),
          regions.loop_variables(symbol, args)};
}

bool Primal::is_named(const Symbol* symbol) const {
  return options.only_requested && options.requested.contains(symbol);
}

std::vector<Expr> Primal::adjoints_at_write(const FuncContents& f, int stage,
                                            const FuncPtr& adjoint) const {
  std::vector<Expr> place;
  Expr inside = const_true();
  const Box& box = regions.of(&f);
  const auto is_inside = [&](const Expr& index, const Interval& range) {
    return can_prove_inside(bounds_of(index, scope_of(regions.domain(f, stage).vars)), range);
  };
  for (size_t d = 0; d < f.args.size(); ++d) {
    Expr index = without_lets(f.stage(stage).args[d]);
    if (depends_on_data(index) && box[d].is_bounded() && !is_inside(index, box[d])) {
      inside = inside && index >= box[d].min && index <= box[d].max;
      index = clamp(index, box[d].min, box[d].max);
    }
    place.push_back(index);
  }
  return numbered(f.types.size(), [&](size_t k) {
    if (!f.types[k].is_float()) return Expr();
    Expr value = call_value(adjoint, place, static_cast<int>(k));
    return is_const_true(inside) ? value : make_select(inside, value, make_zero(value.type()));
  });
}

SweepResult Primal::sweep(const std::vector<Expr>& values, const std::vector<Expr>& seeds,
                          const Symbol* except) const {
  return sweep_reverse(
      values, seeds,
      [&](const Expr& leaf) {
        return active.contains(leaf) && (!except || symbol_of(leaf) != except);
      },
      ranges);
}

}  // namespace retrograde::autodiff
