#include "autoschedule/row_guests.h"

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_set>

#include "analysis/interval.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/read_estimate.h"
#include "autoschedule/row_groups.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

using analysis::Scope;

bool is_made_from(const FuncPtr& f, const FuncPtr& other) {
  const std::vector<FuncPtr> order = topological_order({f});
  return std::ranges::find(order, other) != order.end();
}

bool is_access(const Call& call) { return call.call_type != CallType::Operator; }

void narrow(SizeEstimate& sizes, const FuncContents& f, const std::string& arg) {
  const auto found = std::ranges::find(f.args, arg);
  if (found != f.args.end())
    sizes = sizes.with_extent(f, static_cast<size_t>(found - f.args.begin()), 1);
}

class GuestFinder {
 public:
  GuestFinder(RowHost& host, const std::vector<FuncPtr>& stored, const StoredReads& reads,
              const std::function<bool(const FuncPtr&)>& is_free, const SizeEstimate& sizes)
      : host_(host), stored_(stored), reads_(reads), is_free_(is_free), sizes_(sizes) {
    for (const Expr& root : roots_with_inlined(*host.host->pure, stored)) {
      walk(root, [&](const Expr& e) {
        const auto* call = e.as<Call>();
        if (call && is_access(*call) && is_own_element(*call)) own_reads_.insert(call->name);
        return true;
      });
    }
  }

  void find() {
    for (const FuncPtr& f : stored_) add_guest(f);
    for (const FuncPtr& f : stored_) add_shared(f);
  }

 private:
  RowHost& host_;
  const std::vector<FuncPtr>& stored_;
  const StoredReads& reads_;
  const std::function<bool(const FuncPtr&)>& is_free_;
  const SizeEstimate& sizes_;
  std::unordered_set<std::string> own_reads_;  // names of what the host reads at its own element

  // Clamps move nothing but places at the border.
  static Expr index_of(const Call& call, size_t d, const FuncContents& reader,
                       const Definition& stage) {
    const auto moves = [&](const Expr& e) {
      const auto uses = [&](const std::string& name) { return uses_variable(e, name); };
      return std::ranges::any_of(reader.args, uses) ||
             std::ranges::any_of(stage.rvars, uses, &ReductionVariable::var);
    };
    return simplify(unclamped(without_lets(call.args[d]), moves));
  }

  bool is_own_element(const Call& call) const {
    const FuncContents& f = *host_.host;
    if (call.args.size() != f.args.size()) return false;
    for (size_t d = 0; d < f.args.size(); ++d) {
      const Expr index = index_of(call, d, f, *f.pure);
      const auto* v = index.as<Variable>();
      if (!v || v->name != f.args[d]) return false;
    }
    return true;
  }

  // ---- guests ----

  void add_guest(const FuncPtr& f) {
    auto guest = guest_of(f);
    if (!guest || is_made_from(f, host_.host) || is_made_from(host_.host, f)) return;
    for (const RowGuest& other : host_.guests) {
      if (is_made_from(f, other.sums) || is_made_from(other.sums, f)) return;
    }
    if (!host_.guests.empty() && host_.groups != guest->groups) return;
    host_.guests.push_back(std::move(guest->guest));
    host_.groups = std::move(guest->groups);
    host_.parallel_groups = guest->parallel;
  }

  // Private parts of an adjoint, of one kind, that add up one block or terms.
  std::optional<GuestOfGroups> guest_of(const FuncPtr& f) const {
    const bool is_partial = f->made && (f->made->lanes > 0 || f->made->has_parts);
    if (!is_partial || f->made->blocks > 0 || f->stage_count() != 2 || f->types.size() != 1 ||
        host_.coordinates.contains(f.get()) || !is_free_(f))
      return std::nullopt;
    for (size_t d = 0; d < f->args.size(); ++d) {
      if (!is_pure_position(*f, f->updates[0], d)) return std::nullopt;
    }
    const auto added = block_read(*f);
    if (!added) return guest_of_rows(f, nullptr, variables_of(f->args));
    const FuncPtr block = func_of(*added->as<Call>());
    const bool is_plain = block->stage_count() == 2 && reads_.of(block).size() == 1 &&
                          reads_.of(block)[0].calls.size() <= 2 && is_free_(block);
    if (!is_plain) return std::nullopt;
    const std::vector<Expr>& place = added->as<Call>()->args;
    auto guest = guest_of_rows(f, block, place);
    return guest ? std::move(guest) : guest_of_groups(f, block, place);
  }

  static std::optional<Expr> block_read(const FuncContents& f) {
    std::optional<Expr> result;
    walk_definition(f.updates[0], [&](const Expr& e) {
      const auto* call = e.as<Call>();
      const FuncPtr callee = call && call->call_type == CallType::Func ? func_of(*call) : nullptr;
      if (callee && callee->made && callee->made->blocks > 0) result = e;
    });
    return result;
  }

  // The reads of what the host reads in its row: their index along each coordinate of rows.
  std::vector<std::vector<Expr>> row_indices(const FuncContents& terms) const {
    std::vector<std::vector<Expr>> result;
    for (const Expr& root : roots_with_inlined(terms.updates[0], stored_)) {
      walk(root, [&](const Expr& e) {
        const auto* call = e.as<Call>();
        if (!call || !is_access(*call) || !own_reads_.contains(call->name)) return true;
        std::vector<Expr>& indices = result.emplace_back();
        for (const RowCoordinate& row : host_.rows)
          indices.push_back(index_of(*call, row.dimension, terms, terms.updates[0]));
        return true;
      });
    }
    return result;
  }

  // `place`: of what has the terms, in terms of the variables of the sums.
  std::optional<GuestOfGroups> guest_of_rows(const FuncPtr& sums, const FuncPtr& block,
                                             const std::vector<Expr>& place) const {
    const FuncContents& terms = block ? *block : *sums;
    std::optional<std::vector<std::string>> rows;
    for (const std::vector<Expr>& indices : row_indices(terms)) {
      const auto found = names_of(indices, terms);
      if (!found || rows.value_or(*found) != *found) return std::nullopt;
      rows = found;
    }
    if (!rows) return std::nullopt;
    GuestOfGroups result{{sums, block, {}}, {}, 0};
    for (const std::string& row : *rows) {
      const auto arg = std::ranges::find(terms.args, row) - terms.args.begin();
      const auto* v = place[static_cast<size_t>(arg)].as<Variable>();
      if (!v || std::ranges::find(sums->args, v->name) == sums->args.end()) return std::nullopt;
      result.guest.loops.push_back(v->name);
    }
    return result;
  }

  // The variables of a Func that are these indices.
  static std::optional<std::vector<std::string>> names_of(const std::vector<Expr>& indices,
                                                          const FuncContents& f) {
    std::vector<std::string> result;
    for (const Expr& index : indices) {
      const auto* v = index.as<Variable>();
      if (!v || std::ranges::find(f.args, v->name) == f.args.end()) return std::nullopt;
      result.push_back(v->name);
    }
    return result;
  }

  std::optional<GuestOfGroups> guest_of_groups(const FuncPtr& sums, const FuncPtr& block,
                                               const std::vector<Expr>& place) const {
    auto result =
        autoschedule::guest_of_groups(host_, sums, block, place, row_indices(*block), sizes_);
    if (!result) return std::nullopt;
    const int64_t rows = rows_of_group(host_, result->groups, sizes_);
    return rows * bytes_of_row(*host_.host) <= sizes_.machine().task_bytes() ? std::move(result)
                                                                             : std::nullopt;
  }

  // ---- shared ----

  void add_shared(const FuncPtr& f) {
    const bool may_move = f->is_pure() && f != host_.host && own_reads_.contains(f->name) &&
                          is_free_(f) && !host_.coordinates.contains(f.get()) &&
                          sizes_.bytes(*f) >= sizes_.machine().near_cache_bytes() &&
                          fits_beside_others(*f) && !reads_.is_hidden(f);
    if (!may_move) return;
    // What the host alone reads is for others to place, as running sums are.
    if (reads_.of(f).size() < 2) return;
    for (const StoredRead& read : reads_.of(f)) {
      if (!is_within_rows(read)) return;
    }
    host_.shared.push_back(f);
  }

  bool fits_beside_others(const FuncContents& f) const {
    int64_t bytes = bytes_of_row(*host_.host) + bytes_of_row(f);
    for (const auto* others : {&host_.inside, &host_.shared}) {
      for (const FuncPtr& other : *others) bytes += bytes_of_row(*other);
    }
    const int64_t rows = host_.groups.empty() ? 1 : rows_of_group(host_, host_.groups, sizes_);
    return rows * bytes <= sizes_.machine().task_bytes();
  }

  // Of a Func with as many rows as the host.
  int64_t bytes_of_row(const FuncContents& f) const {
    int64_t rows = 1;
    for (const auto& [dimension, divisor] : host_.rows)
      rows *= (sizes_.extent(*host_.host, dimension).value_or(1) + divisor - 1) / divisor;
    return sizes_.bytes(f) / rows;
  }

  bool is_within_rows(const StoredRead& read) const {
    const auto reads_all = [&](const auto& is_good) {
      return std::ranges::all_of(read.calls, [&](const Expr& e) { return is_good(*e.as<Call>()); });
    };
    if (read.reader == host_.host)
      return reads_all([&](const Call& call) { return is_own_element(call); });
    for (const RowGuest& guest : host_.guests) {  // which reads nothing else
      if ((guest.block ? guest.block : guest.sums) == read.reader) return read.stage == 1;
    }
    const auto known = host_.coordinates.find(read.reader.get());
    if (known == host_.coordinates.end()) return false;
    return reads_all([&](const Call& call) {
      return is_in_row(call, *read.reader, read.reader->stage(read.stage), known->second);
    });
  }

  // Whether a member reads elements of its row only.
  bool is_in_row(const Call& call, const FuncContents& f, const Definition& stage,
                 const RowCoordinates& all) const {
    Scope<Interval> scope;
    for (const ReductionVariable& r : stage.rvars)
      scope.push(r.var, {r.min, simplify(r.min + r.extent - 1)});
    for (size_t d = 0; d < f.args.size(); ++d) {
      const Interval range = sizes_.range(f, d);
      if (!all[d] && range.is_bounded()) scope.push(f.args[d], range);
    }
    return std::ranges::all_of(host_.rows, [&](const RowCoordinate& row) {
      const auto arg = std::ranges::find(all, std::optional(row)) - all.begin();
      const Expr first =
          variable(f.args[static_cast<size_t>(arg)]) * make_const(Int(32), row.divisor);
      const Interval reached = analysis::bounds_of(index_of(call, row.dimension, f, stage), scope);
      if (!reached.is_bounded()) return false;
      const auto low = as_const_int(simplify(reached.min - first)),
                 high = as_const_int(simplify(reached.max - first));
      return low && high && *low >= 0 && *high < row.divisor;
    });
  }
};

}  // namespace

void add_row_guests(RowHost& host, const std::vector<FuncPtr>& stored, const StoredReads& reads,
                    const std::function<bool(const FuncPtr&)>& is_free, const SizeEstimate& sizes) {
  GuestFinder(host, stored, reads, is_free, sizes).find();
}

void give_loops_of_guest(const RowGuest& guest, const GiveLoopsOfStage& give,
                         const SizeEstimate& sizes) {
  SizeEstimate of_row = sizes;
  for (const std::string& loop : guest.loops) narrow(of_row, *guest.sums, loop);
  if (guest.block) {
    for (const std::string& loop : guest.loops) narrow(of_row, *guest.block, loop);
  }
  give(guest.sums, 1, of_row);
  give(guest.sums, 0, sizes);
}

}  // namespace retrograde::autoschedule
