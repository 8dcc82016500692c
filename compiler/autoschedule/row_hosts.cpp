#include "autoschedule/row_hosts.h"

#include <algorithm>
#include <string>
#include <utility>

#include "autoschedule/cost_estimate.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/loop_order.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/only_reader.h"
#include "autoschedule/read_estimate.h"
#include "autoschedule/row_guests.h"
#include "autoschedule/row_host_loops.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

constexpr double least_terms_of_row = 32;                // of a sum along a row
constexpr double few_terms = 512;                        // which may be added one by one
constexpr int64_t least_row = planning::schedule_lanes;  // elements along the first dimension
constexpr int64_t long_piece =
    planning::page_bytes;  // bytes of a row, where it does not lie together

bool has_many_terms(const FuncContents& f) {
  return std::ranges::any_of(f.updates, [](const Definition& update) {
    return terms_of(update, 0) >= least_terms_of_row;
  });
}

bool is_partial(const FuncContents& f) {
  return f.made && (f.made->lanes > 0 || f.made->has_parts || f.made->blocks > 0);
}

bool is_moved(const Call& call, const Definition& update, size_t d) {
  return std::ranges::any_of(
      update.rvars, [&](const ReductionVariable& r) { return uses_variable(call.args[d], r.var); });
}

// Whether vectors of terms lie along rows of all that the update reads, so that it needs no other rows to be fast.
bool runs_along_rows(const FuncContents& f, const Definition& update,
                     const std::vector<FuncPtr>& stored) {
  const double terms = terms_of(update, 0);
  if (f.made && terms > 0 && terms <= few_terms) return true;
  const Kind kind = without_lets(update.values[0]).kind();
  if (kind != Kind::Add && kind != Kind::Sub && kind != Kind::Min && kind != Kind::Max)
    return false;
  bool result = terms >= least_terms_of_row;
  const Expr first = simplify(update.rvars[0].extent);
  result &= as_const_int(first).value_or(0) >= least_terms_of_row;
  for (const Expr& root : roots_with_inlined(update, stored)) {
    walk(root, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (!call || call->call_type == CallType::Operator || call->name == f.name) return true;
      const size_t row = innermost_dimension(*call);
      for (size_t d = 0; d < call->args.size(); ++d) {
        result &= !reads_memory(call->args[d], MemoryReads::Functions);
        result &= d == row || !is_moved(*call, update, d) || is_moved(*call, update, row);
      }
      return true;
    });
  }
  return result;
}

class HostFinder {
 public:
  HostFinder(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
             const std::unordered_set<const Symbol*>& excluded, const SizeEstimate& sizes)
      : order_(topological_order(outputs)),
        stored_(stored),
        excluded_(excluded),
        sizes_(sizes),
        reads_(outputs, stored) {
    for (const FuncPtr& f : outputs) outputs_.insert(f.get());
    for (const FuncPtr& f : stored) at_root_.insert(f.get());
  }

  std::optional<RowHost> find(const FuncPtr& f) {
    if (!may_be_host(*f)) return std::nullopt;
    RowHost host;
    host.host = f;
    RowCoordinates& own = host.coordinates[f.get()];
    own.resize(f->args.size());
    for (size_t d = 1; d < own.size(); ++d) own[d] = RowCoordinate{d};
    for (auto member = order_.rbegin(); member != order_.rend(); ++member) {  // consumers first
      if (*member == f || !may_be_member(**member)) continue;
      if (is_read_in_place(*member, host))
        add_inside(*member, host);
      else
        add(*member, host);
    }
    return is_worth_while(host) ? std::optional(std::move(host)) : std::nullopt;
  }

  void add_guests(RowHost& host) const {
    add_row_guests(
        host, stored_, reads_,
        [&](const FuncPtr& f) { return is_free(*f) && !outputs_.contains(f.get()); }, sizes_);
  }

  void exclude(const FuncPtr& f) { taken_.insert(f.get()); }

 private:
  const std::vector<FuncPtr> order_;
  const std::vector<FuncPtr>& stored_;
  const std::unordered_set<const Symbol*>& excluded_;
  const SizeEstimate& sizes_;
  const StoredReads reads_;
  std::unordered_set<const Symbol*> outputs_, at_root_, taken_;

  bool is_free(const FuncContents& f) const {
    return !f.is_extern() && !has_directives(f) && !excluded_.contains(&f) && !taken_.contains(&f);
  }

  bool may_be_host(const FuncContents& f) const {
    return f.is_pure() && is_free(f) && at_root_.contains(&f) && f.args.size() > 1 &&
           sizes_.extent(f, 0).value_or(0) >= least_row &&
           sizes_.bytes(f) >= sizes_.machine().near_cache_bytes();
  }

  // The blocks of a sum are computed where they are added up.
  bool may_be_member(const FuncContents& f) const {
    const bool is_block = f.made && f.made->blocks > 0;
    return is_free(f) && !outputs_.contains(&f) && (at_root_.contains(&f) || is_block) &&
           !f.args.empty() && f.types.size() == 1;
  }

  // An output whose every element is that of the member.
  bool is_copy(const StoredRead& read, const FuncContents& member) const {
    const FuncContents& f = *read.reader;
    if (!f.is_pure() || !outputs_.contains(&f) || !is_free(f) || f.pure->values.size() != 1)
      return false;
    const Expr value = without_lets(f.pure->values[0]);
    const auto* call = value.as<Call>();
    return call && call->symbol.raw() == &member && same_args(call->args, f.pure->args);
  }

  // The coordinate that an index selects, in a definition of a Func with the coordinates `known`.
  static std::optional<RowCoordinate> coordinate(const Expr& any_index, const FuncContents& reader,
                                                 const RowCoordinates& known) {
    const auto moves = [&](const Expr& e) {
      return std::ranges::any_of(reader.args,
                                 [&](const std::string& arg) { return uses_variable(e, arg); });
    };
    const Expr index = unclamped(without_lets(any_index), moves);
    if (const auto* quotient = index.as<Div>()) {
      const auto divisor = as_const_int(quotient->b);
      auto of = coordinate(quotient->a, reader, known);
      if (!of || !divisor || *divisor < 1 || of->divisor > 1) return std::nullopt;
      return RowCoordinate{of->dimension, *divisor};
    }
    const auto* variable = index.as<Variable>();
    const auto arg = variable ? std::ranges::find(reader.args, variable->name) : reader.args.end();
    return arg == reader.args.end() ? std::nullopt
                                    : known[static_cast<size_t>(arg - reader.args.begin())];
  }

  void add(const FuncPtr& f, RowHost& host) {
    if (reads_.is_hidden(f) || reads_.of(f).empty()) return;
    std::optional<RowCoordinates> all;
    std::vector<FuncPtr> copies;
    for (const StoredRead& read : reads_.of(f)) {
      if (is_copy(read, *f)) {
        copies.push_back(read.reader);
        continue;
      }
      const auto reader = host.coordinates.find(read.reader.get());
      if (reader == host.coordinates.end()) return;
      for (const Expr& e : read.calls) {
        RowCoordinates found;
        for (const Expr& index : e.as<Call>()->args)
          found.push_back(coordinate(index, *read.reader, reader->second));
        if (all.value_or(found) != found) return;
        all = std::move(found);
      }
    }
    if (!all || !stays_in_rows(*f, *all) || !is_same_row(*f, *all, host)) return;
    host.members.push_back(f);
    for (const FuncPtr& copy : copies) {
      host.copies.push_back(copy);
      host.coordinates[copy.get()] = *all;
    }
    host.coordinates[f.get()] = std::move(*all);
  }

  // Whether it is a Func of the host's elements, each of which the host, or what is inside, reads for its own. Running
  // sums of adjoints are at root, so that what they read can go.
  bool is_read_in_place(const FuncPtr& f, const RowHost& host) const {
    const std::vector<StoredRead>& all = reads_.of(f);
    return f->is_pure() && !f->made && f->args.size() == host.host->args.size() && !all.empty() &&
           !reads_.is_hidden(f) && sizes_.bytes(*f) >= sizes_.machine().near_cache_bytes() &&
           std::ranges::all_of(all, [&](const StoredRead& read) {
             const bool is_own = read.reader == host.host ||
                                 std::ranges::find(host.inside, read.reader) != host.inside.end();
             return is_own && std::ranges::all_of(read.calls, [&](const Expr& e) {
                      return same_args(e.as<Call>()->args, variables_of(read.reader->args));
                    });
           });
  }

  static void add_inside(const FuncPtr& f, RowHost& host) {
    host.inside.push_back(f);
    host.coordinates[f.get()] = host.coordinates.at(host.host.get());
  }

  // All members have the coordinates of the first one.
  static bool is_same_row(const FuncContents& f, const RowCoordinates& all, RowHost& host) {
    std::vector<RowCoordinate> rows;
    for (const auto& c : all) {
      if (c) rows.push_back(*c);
    }
    if (rows.empty() || (rows.size() < all.size() && !is_partial(f))) return false;
    std::ranges::sort(rows);
    const auto same = [](const RowCoordinate& a, const RowCoordinate& b) {
      return a.dimension == b.dimension;
    };
    if (std::ranges::adjacent_find(rows, same) != rows.end()) return false;
    if (host.rows.empty()) host.rows = rows;
    return host.rows == rows;
  }

  bool stays_in_rows(const FuncContents& f, const RowCoordinates& all) const {
    for (int s = 0; s < f.stage_count(); ++s) {
      const Definition& stage = f.stage(s);
      if (read_elsewhere(f, stage).defined()) return false;
      for (size_t d = 0; d < all.size(); ++d) {
        if (all[d] && !is_pure_position(f, stage, d)) return false;
      }
      if (!stage.rvars.empty() && !is_partial(f) && !runs_along_rows(f, stage, stored_))
        return false;
    }
    return true;
  }

  // Whether a row lies together in memory, or in long pieces.
  bool is_together(const RowHost& host) const {
    const size_t first = host.rows.front().dimension;
    if (host.rows.size() + first >= host.host->args.size()) return true;
    int64_t bytes = total_bytes(host.host->types);
    for (size_t d = 0; d < first; ++d) bytes *= sizes_.extent(*host.host, d).value_or(0);
    return bytes >= long_piece;
  }

  // Rows that stay in a cache near the core, of a Func that does not, and enough of them.
  bool is_worth_while(const RowHost& host) const {
    if (host.rows.empty() || !is_together(host)) return false;
    int64_t rows = 1;
    for (const auto& [dimension, divisor] : host.rows)
      rows *= (sizes_.extent(*host.host, dimension).value_or(0) + divisor - 1) / divisor;
    int64_t bytes = sizes_.bytes(*host.host);
    for (const FuncPtr& f : host.inside) bytes += sizes_.bytes(*f);
    return rows >= enough_rows && bytes / rows <= sizes_.machine().task_bytes() &&
           std::ranges::any_of(host.members, [](const FuncPtr& f) { return has_many_terms(*f); });
  }
};

// The outermost loop over elements of each update.
void run_in_parallel(const FuncPtr& f) {
  if (f->schedule.compute_level.kind != graph::LoopLevel::Kind::Root) return;
  for (int s = 1; s < f->stage_count(); ++s) {
    const Dim& loop = f->stage(s).schedule.dims.back();
    if (!loop.is_reduction && loop.runs == ForType::Serial) Stage(f, s).parallel(Var(loop.var));
  }
}

}  // namespace

RowHosts::RowHosts(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
                   const std::unordered_set<const Symbol*>& excluded, const SizeEstimate& sizes)
    : sizes_(sizes) {
  if (std::ranges::none_of(stored, [](const FuncPtr& f) { return has_many_terms(*f); })) return;
  HostFinder finder(outputs, stored, excluded, sizes);
  for (auto f = stored.rbegin(); f != stored.rend();
       ++f) {  // consumers first: they may take others inside
    auto host = finder.find(*f);
    if (!host) continue;
    finder.add_guests(*host);
    std::vector<FuncPtr> all{host->host};
    all.insert(all.end(), host->members.begin(), host->members.end());
    all.insert(all.end(), host->copies.begin(), host->copies.end());
    all.insert(all.end(), host->inside.begin(), host->inside.end());
    all.insert(all.end(), host->shared.begin(), host->shared.end());
    for (const RowGuest& guest : host->guests) all.push_back(guest.sums);
    for (const FuncPtr& each : all) {
      role_[each.get()] = hosts_.size();
      finder.exclude(each);
    }
    hosts_.push_back(std::move(*host));
  }
}

std::unordered_set<const Symbol*> RowHosts::all() const {
  std::unordered_set<const Symbol*> result;
  for (const auto& [f, index] : role_) result.insert(f);
  return result;
}

void RowHosts::give_loops(const FuncPtr& f, const GiveLoopsOfStage& give) const {
  const RowHost& host = hosts_[role_.at(f.get())];
  const auto is_one_of = [&](const std::vector<FuncPtr>& funcs) {
    return std::ranges::find(funcs, f) != funcs.end();
  };
  if (f == host.host || is_one_of(host.inside) || is_one_of(host.shared)) return give(f, 0, sizes_);
  if (is_one_of(host.copies)) return;
  const auto guest = std::ranges::find(host.guests, f, &RowGuest::sums);
  if (guest != host.guests.end()) return give_loops_of_guest(*guest, give, sizes_);
  SizeEstimate of_row = sizes_;
  for (const FuncPtr& member : host.members) {
    const RowCoordinates& all = host.coordinates.at(member.get());
    for (size_t d = 0; d < all.size(); ++d) {
      if (all[d]) of_row = of_row.with_extent(*member, d, 1);
    }
  }
  for (int s = 1; s < f->stage_count(); ++s) give(f, s, of_row);
  const RowCoordinates& own = host.coordinates.at(f.get());
  if (std::ranges::any_of(own, [](const auto& c) { return !c; })) give(f, 0, of_row);
}

void RowHosts::move() const {
  for (const RowHost& host : hosts_) {
    if (has_plain_rows(*host.host)) {
      move_into_rows(host, sizes_);
    } else {  // its loops were chosen for other reasons, so that the members stay at root
      for (const FuncPtr& f : host.members) run_in_parallel(f);
    }
  }
}

}  // namespace retrograde::autoschedule
