#include "autoschedule/row_readers.h"

#include <algorithm>
#include <functional>

#include "autoschedule/cut_reductions.h"
#include "autoschedule/inlined_reads.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

// Without what keeps a place inside of its Func: it moves nothing but places at the border.
Expr without_clamps(const Expr& place) {
  return rewrite(place, [](const Expr& e, const std::function<Expr(const Expr&)>& recurse) {
    const Expr mapped = map_children(e, recurse);
    if (const auto* call = as_op(mapped, Op::likely)) return call->args[0];
    const auto without_bound = [&](const Expr& a, const Expr& b) {
      return is_const(b) ? a : is_const(a) ? b : mapped;
    };
    if (const auto* low = mapped.as<Min>()) return without_bound(low->a, low->b);
    if (const auto* high = mapped.as<Max>()) return without_bound(high->a, high->b);
    return mapped;
  });
}

bool is_row(const StageReads::Reading& reading, size_t dimension, const Expr& row) {
  return std::all_of(reading.places.begin(), reading.places.end(),
                     [&](const std::vector<Expr>& place) {
                       return dimension < place.size() &&
                              is_zero(simplify(without_clamps(place[dimension]) - row));
                     });
}

std::optional<RowReader> pure_reader(const StageReads::Reading& reading, size_t row) {
  const FuncPtr& f = reading.func;
  if (!f->is_pure() || f->is_extern()) return std::nullopt;
  for (size_t d = 1; d < f->args.size(); ++d) {
    if (is_row(reading, row, variable(f->args[d])))
      return RowReader{RowReader::Kind::Pure, f, 0, f->args[d], {}, nullptr};
  }
  return std::nullopt;
}

std::optional<RowReader> sum_reader(const StageReads::Reading& reading, size_t row,
                                    const SizeEstimate& sizes) {
  if (reading.stage != 1 || reading.func->stage_count() != 2) return std::nullopt;
  const auto loop = rows_of_sum(reading.func, 1, sizes);
  if (!loop || !is_row(reading, row, variable(*loop))) return std::nullopt;
  return RowReader{RowReader::Kind::Sum, reading.func, 1, *loop, {}, nullptr};
}

// parts(lane, ..., part) += block(lane, ..., part, loops)
std::optional<RowReader> parts_reader(const StageReads& reads, const StageReads::Reading& reading,
                                      size_t row) {
  const FuncPtr &block = reading.func, parts = reads.adder_of(block);
  const bool adds_up = parts && parts->made && parts->made->has_parts && parts->made->lanes > 0 &&
                       parts->stage_count() == 2 && parts->types.size() == 1;
  if (!adds_up || reading.stage != 1 || block->stage_count() != 2) return std::nullopt;
  const Definition& update = parts->updates[0];
  for (size_t d = 0; d < parts->args.size(); ++d) {
    if (!is_pure_position(*parts, update, d)) return std::nullopt;
  }
  const Call* added = nullptr;
  walk_definition(update, [&](const Expr& e) {
    const auto* call = e.as<Call>();
    if (call && call->symbol.raw() == block.get()) added = call;
  });
  if (!added) return std::nullopt;
  const auto in_block = [&](const std::string& loop) {  // its variable there
    for (size_t d = 0; d < added->args.size(); ++d) {
      const auto* v = added->args[d].as<Variable>();
      if (v && v->name == loop) return variable(block->args[d]);
    }
    return Expr();
  };
  const Expr part = in_block(parts->args.back());
  for (const ReductionVariable& r : update.rvars) {
    const Expr step = in_block(r.var);
    if (!part.defined() || !step.defined() || !as_const_int(simplify(r.extent))) continue;
    if (is_row(reading, row, part * r.extent + step))
      return RowReader{RowReader::Kind::Parts, parts, 1, r.var, parts->args.back(), block};
  }
  return std::nullopt;
}

}  // namespace

StageReads::StageReads(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored) {
  for (const FuncPtr& f : topological_order(outputs)) {
    const bool is_output = std::find(outputs.begin(), outputs.end(), f) != outputs.end();
    if (!is_output && is_computed_inline(f, stored)) continue;
    for (int s = 0; s < f->stage_count(); ++s)
      stages_.push_back({f, s, roots_with_inlined(f->stage(s), stored)});
  }
}

std::vector<StageReads::Reading> StageReads::of(const FuncContents& f) const {
  std::vector<Reading> result;
  for (const Roots& stage : stages_) {
    if (stage.func.get() == &f) continue;
    Reading reading{stage.func, stage.stage, {}};
    for (const Expr& root : stage.roots) {
      walk(root, [&](const Expr& e) {
        const auto* call = e.as<Call>();
        if (call && call->symbol.raw() == &f) reading.places.push_back(call->args);
        return true;
      });
    }
    if (!reading.places.empty()) result.push_back(std::move(reading));
  }
  return result;
}

FuncPtr StageReads::adder_of(const FuncPtr& block) const {
  if (!block->made || block->made->blocks == 0) return nullptr;
  const std::vector<Reading> readings = of(*block);
  return readings.size() == 1 ? readings[0].func : nullptr;
}

std::optional<RowReader> row_reader(const StageReads& reads, const StageReads::Reading& reading,
                                    size_t row, const SizeEstimate& sizes) {
  if (auto parts = parts_reader(reads, reading, row)) return parts;
  if (auto sum = sum_reader(reading, row, sizes)) return sum;
  return pure_reader(reading, row);
}

}  // namespace retrograde::autoschedule
