#include "autoschedule/reduction_slices.h"

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "analysis/linear.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/only_reader.h"
#include "autoschedule/read_estimate.h"
#include "autoschedule/slices.h"
#include "autoschedule/stored_reads.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/loop_level.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/lets.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t enough_slices = planning::reference_tasks;
constexpr int64_t strip_rows = 32, least_rows = 8;
constexpr int64_t enough_strips = 2 * planning::reference_tasks;  // each is a task
constexpr size_t image_dimensions = 2;                            // of a slice, at least

// How a Func moves into the loops of its reader.
struct Move {
  std::vector<std::string> slices;  // reduction variables, innermost first
  std::string along;                // the loop that is cut into strips
  int64_t rows = strip_rows;
};

class ReductionSlicer {
 public:
  ReductionSlicer(const FuncPtr& f, const Reader& reader, const SizeEstimate& sizes)
      : f_(*f), reader_(reader), stage_(reader.definition()), sizes_(sizes) {}

  // nullopt: it does not pay, or the reader's loops have another order already.
  std::optional<Move> find() const {
    Move move;
    int64_t slices = 1;
    for (const ReductionVariable& r : stage_.rvars) {
      const auto extent = as_const_int(simplify(r.extent));
      if (!extent || !is_sliced_by(r.var)) continue;
      move.slices.push_back(r.var);
      slices *= *extent;
    }
    if (slices < enough_slices || f_.args.size() < move.slices.size() + image_dimensions ||
        sizes_.bytes(f_) < sizes_.machine().last_cache_bytes() || !has_plain_loops())
      return std::nullopt;
    move.along = stage_.schedule.dims.back().var;
    const auto along = std::find(reader_.func->args.begin(), reader_.func->args.end(), move.along);
    const auto rows =
        sizes_.extent(*reader_.func, static_cast<size_t>(along - reader_.func->args.begin()));
    if (!rows) return std::nullopt;
    while (move.rows > least_rows && *rows < move.rows * enough_strips) move.rows /= 2;
    return 2 * reach(move) <= move.rows ? std::optional(move) : std::nullopt;
  }

 private:
  // Only the vectors have been cut off, and the outermost loop is one over elements.
  bool has_plain_loops() const {
    const std::vector<Dim>& loops = stage_.schedule.dims;
    const FuncContents& g = *reader_.func;
    if (stage_.schedule.splits.size() > 1 || loops.empty() || loops.back().is_reduction)
      return false;
    const auto arg = std::find(g.args.begin(), g.args.end(), loops.back().var);
    return arg != g.args.end() && arg != g.args.begin() && !is_split(stage_, loops.back().var) &&
           is_pure_position(g, stage_, static_cast<size_t>(arg - g.args.begin()));
  }

  std::vector<std::string> loop_names() const {
    std::vector<std::string> names = reader_.func->args;
    for (const ReductionVariable& r : stage_.rvars) names.push_back(r.var);
    return names;
  }

  // Whether one and the same index of all reads is the variable, but for a constant; along it each
  // element is computed for itself.
  bool is_sliced_by(const std::string& var) const {
    for (size_t d = 0; d < f_.args.size(); ++d) {
      const bool is_slice = std::all_of(
          reader_.reads.begin(), reader_.reads.end(),
          [&](const Call* read) { return is_alone(read->args[d], var) && is_same(*read, d); });
      if (is_slice && is_pure_in_all(d)) return true;
    }
    return false;
  }
  bool is_same(const Call& read, size_t d) const {
    return equal(read.args[d], reader_.reads[0]->args[d]);
  }
  bool is_pure_in_all(size_t d) const {
    for (int s = 0; s < f_.stage_count(); ++s) {
      if (!is_pure_position(f_, f_.stage(s), d)) return false;
    }
    return true;
  }
  bool is_alone(const Expr& any_index, const std::string& var) const {
    const std::vector<std::string> names = loop_names();
    const auto form = decompose(moving_part(any_index), names);
    if (!form) return false;
    return std::all_of(form->coefficients.begin(), form->coefficients.end(), [&](const auto& c) {
      return c.first == var ? std::abs(c.second) == 1 : c.second == 0;
    });
  }
  Expr moving_part(const Expr& index) const {
    const std::vector<std::string> names = loop_names();
    return unclamped(without_lets(index), [&](const Expr& e) {
      return std::any_of(names.begin(), names.end(),
                         [&](const std::string& name) { return uses_variable(e, name); });
    });
  }

  // Rows that a slice has beyond those of a strip, at most: where reads move apart with the slices,
  // or other loops move one.
  int64_t reach(const Move& move) const {
    int64_t most = 0;
    for (size_t d = 0; d < f_.args.size(); ++d) {
      const bool move_together = std::all_of(reader_.reads.begin(), reader_.reads.end(),
                                             [&](const Call* read) { return is_same(*read, d); });
      for (const Call* read : reader_.reads) {
        const Expr index = moving_part(read->args[d]);
        if (!uses_variable(index, move.along)) continue;
        most = std::max(most,
                        shift_of(index, move_together ? move.slices : std::vector<std::string>()));
      }
    }
    return most;
  }
  // How far the reduction moves the row, either way; `but` by these variables.
  int64_t shift_of(const Expr& index, const std::vector<std::string>& but) const {
    const auto form = decompose(index, loop_names());
    if (!form) return strip_rows;  // too far
    int64_t shift = 0;
    for (const ReductionVariable& r : stage_.rvars) {
      if (std::find(but.begin(), but.end(), r.var) != but.end()) continue;
      const int64_t last = as_const_int(simplify(r.extent)).value_or(strip_rows) - 1;
      for (const auto& [name, step] : form->coefficients)
        shift += name == r.var ? std::abs(step) * last : 0;
    }
    return shift;
  }

  const FuncContents& f_;
  const Reader& reader_;
  const Definition& stage_;
  const SizeEstimate& sizes_;
};

// The loops of the reader: strips outermost, in them the slices.
void cut_into_strips(const Reader& reader, const Move& move) {
  Stage stage(reader.func, reader.stage);
  const auto is_slice = [&](const std::string& var) {
    return std::find(move.slices.begin(), move.slices.end(), var) != move.slices.end();
  };
  std::vector<VarOrRVar> order;
  for (const Dim& loop : reader.definition().schedule.dims) {
    if (loop.var == move.along || is_slice(loop.var)) continue;
    order.push_back(VarOrRVar(loop.var, loop.is_reduction));
  }
  const Var strips(move.along), row(inner_loop(*reader.func, reader.stage, move.along));
  stage.split(strips, strips, row, static_cast<int>(move.rows), TailStrategy::GuardWithIf);
  stage.serial(row);  // the strips are the tasks
  order.push_back(row);
  for (const std::string& var : move.slices) order.push_back(RVar(var));
  order.push_back(strips);
  stage.reorder(order);
}

// With what is computed in its loops.
void run_serially(const FuncPtr& f, const std::vector<FuncPtr>& stored) {
  for (const FuncPtr& inner : stored) {
    const graph::LoopLevel& level = inner->schedule.compute_level;
    if (level.kind == graph::LoopLevel::Kind::At && level.func == f->name)
      run_serially(inner, stored);
  }
  autoschedule::run_serially(f);
}

// A Func that has moved, in turn a reader of slices.
struct Moved {
  FuncPtr func;
  retrograde::LoopLevel level;
  std::vector<size_t> dimensions;  // that the loops move: of slices, and of strips
};

// Whether the loops of slices or of strips move this index of a read.
bool is_moved_by_all(const Reader& reader, size_t d, const Move& move) {
  return std::all_of(reader.reads.begin(), reader.reads.end(), [&](const Call* read) {
    return uses_variable(read->args[d], move.along) ||
           std::any_of(move.slices.begin(), move.slices.end(),
                       [&](const std::string& var) { return uses_variable(read->args[d], var); });
  });
}

class ReductionMover {
 public:
  ReductionMover(const std::vector<FuncPtr>& outputs, const Readers& readers,
                 const std::vector<FuncPtr>& stored, const std::unordered_set<const Symbol*>& but,
                 const SizeEstimate& sizes)
      : readers_(readers), stored_(stored), but_(but), sizes_(sizes), reads_(outputs) {}

  void move_into_reduction(const FuncPtr& f) {
    const auto reader = only_reader(f);
    if (!reader || !is_at_root(*reader->func) || cut_.contains(reader->func.get())) return;
    const auto move = ReductionSlicer(f, *reader, sizes_).find();
    if (!move) return;
    cut_.insert(reader->func.get());
    cut_into_strips(*reader, *move);
    const retrograde::LoopLevel level(Func(reader->func), RVar(move->slices[0]), reader->stage);
    std::vector<size_t> dimensions;
    for (size_t d = 0; d < f->args.size(); ++d) {
      if (is_moved_by_all(*reader, d, *move)) dimensions.push_back(d);
    }
    place(f, level, std::move(dimensions));
  }

  // In the loops that its reader has moved into.
  void move_behind(const FuncPtr& f) {
    const auto reader = only_reader(f);
    const auto found = std::find_if(moved_.begin(), moved_.end(), [&](const Moved& moved) {
      return reader && moved.func == reader->func;
    });
    if (found == moved_.end()) return;
    std::vector<size_t> dimensions;
    for (const size_t d : found->dimensions) {
      const auto own = sliced_by(*f, *reader, reader->func->args[d]);
      if (!own) return;
      dimensions.push_back(*own);
    }
    place(f, found->level, std::move(dimensions));
  }

  bool may_move(const FuncPtr& f) const {
    const bool is_partial = f->made && (f->made->lanes > 0 || f->made->has_parts);
    return f->args.size() > image_dimensions && !f->is_extern() && !is_partial &&
           !but_.contains(f.get()) && is_at_root(*f) && readers_.is_inside(f) &&
           !readers_.is_output(f) && sizes_.bytes(*f) >= sizes_.machine().last_cache_bytes();
  }

 private:
  std::optional<Reader> only_reader(const FuncPtr& f) const {
    const std::vector<StoredRead>& all = reads_.of(f);
    if (all.size() != 1 || reads_.is_hidden(f) || !readers_.is_inside(all[0].reader) ||
        but_.contains(all[0].reader.get()))
      return std::nullopt;
    Reader reader{all[0].reader, all[0].stage, {}};
    for (const Expr& call : all[0].calls) reader.reads.push_back(call.as<Call>());
    return reader;
  }

  void place(const FuncPtr& f, const retrograde::LoopLevel& level, std::vector<size_t> dimensions) {
    run_serially(f, stored_);
    Func(f).compute_at(level);
    moved_.push_back({f, level, std::move(dimensions)});
  }

  const Readers& readers_;
  const std::vector<FuncPtr>& stored_;
  const std::unordered_set<const Symbol*>& but_;
  const SizeEstimate& sizes_;
  const StoredReads reads_;
  std::unordered_set<const Symbol*> cut_;  // readers whose loops are strips now
  std::vector<Moved> moved_;
};

}  // namespace

void compute_in_reductions(const std::vector<FuncPtr>& outputs, const Readers& readers,
                           const std::vector<FuncPtr>& stored,
                           const std::unordered_set<const Symbol*>& but,
                           const SizeEstimate& sizes) {
  ReductionMover mover(outputs, readers, stored, but, sizes);
  for (const FuncPtr& f : stored) {
    if (mover.may_move(f)) mover.move_into_reduction(f);
  }
  for (auto f = stored.rbegin(); f != stored.rend(); ++f) {  // readers first
    if (mover.may_move(*f)) mover.move_behind(*f);
  }
}

}  // namespace retrograde::autoschedule
