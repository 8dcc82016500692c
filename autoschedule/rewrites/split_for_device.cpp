#include "autoschedule/rewrites/split_for_device.h"

#include <algorithm>
#include <bit>

#include "autoschedule/access/long_sums.h"
#include "autoschedule/access/sizes.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/rewrites/split_update.h"
#include "graph/definitions/associative_update.h"
#include "graph/definitions/race_checks.h"

namespace retrograde::planning {

using namespace graph;

namespace {

constexpr int64_t terms_of_part = 16;  // for each of its elements
constexpr int64_t least_parts = 8;
constexpr int64_t unknown_terms = 1 << 14;  // of a loop
constexpr int64_t most_terms = 1 << 30;     // that one loop counts

class DeviceSplitter {
 public:
  DeviceSplitter(const std::vector<FuncPtr>& outputs, const SplitForDevice& how)
      : accesses_(outputs),
        sizes_(accesses_, {unknown_extent}),
        dependences_(accesses_),
        how_(how),
        device_(*how.device) {}

  void run(ir::FunctionRef<bool(const FuncContents&)> may_change) {
    for (const FuncNode& node : accesses_.funcs()) {
      if (!may_change(*node.func)) continue;
      for (const StageNode& stage : node.stages) {
        if (stage.id.stage == 0 || !is_wanted(stage)) continue;
        const Sum sum = sum_of(stage);
        if (const int64_t parts = parts_of(sum); parts > 0) split(sum, parts);
      }
    }
  }

 private:
  const AccessGraph accesses_;
  const SizeModel sizes_;
  Dependences dependences_;
  const SplitForDevice& how_;
  const Device& device_;

  struct Sum {
    const StageNode& stage;
    FuncPtr func;
    std::vector<int> terms;  // iterators whose iterations meet, innermost first
    int64_t elements = 1;    // that run apart; 0: they may be many
    size_t fused = 0;        // the first terms, which are split as one loop
    bool commutes = false;
  };

  bool is_wanted(const StageNode& stage) {
    return (adds_in_place(stage) ? how_.sums : how_.scatters) && !stage.needs_host &&
           !dependences_.may_be_atomic(stage.id, how_.atomics);
  }

  int64_t extent(const Sum& sum, int iterator) const {
    const Extent e = sizes_.of(sum.stage.id, iterator);
    return e.is_known() ? e.estimate : unknown_terms;
  }
  bool is_known(const Sum& sum, int iterator) const {
    return sizes_.of(sum.stage.id, iterator).is_known();
  }
  int64_t product(const Sum& sum, size_t count) const {
    int64_t result = 1;
    for (size_t i = 0; i < count; ++i)
      result = std::min(result * std::max<int64_t>(extent(sum, sum.terms[i]), 0), most_terms);
    return result;
  }

  Sum sum_of(const StageNode& stage) {
    Sum sum{stage, accesses_.func(stage.id.func).func, {}, 1, 0, false};
    const FuncContents& f = *sum.func;
    sum.commutes = can_prove_commutative(f, f.stage(stage.id.stage));
    for (size_t i = 0; i < stage.iterators.size(); ++i) {
      const auto iterator = static_cast<int>(i);
      const bool is_pure = stage.iterators[i].kind == Iterator::Kind::Pure;
      if (!is_pure && !dependences_.may_run_at_once(stage.id, iterator)) {
        sum.terms.push_back(iterator);
        continue;
      }
      sum.elements *= is_known(sum, iterator) ? extent(sum, iterator) : 0;
      sum.elements = std::min(sum.elements, device_.few_threads());
    }
    // Coordinates of fused loops follow by division, for which all extents but the last have to be known.
    int64_t terms = 1;
    while (sum.fused < sum.terms.size()) {
      terms *= std::max<int64_t>(extent(sum, sum.terms[sum.fused]), 1);
      if (sum.fused > 0 && (terms > most_terms || !is_known(sum, sum.terms[sum.fused - 1]))) break;
      ++sum.fused;
    }
    return sum;
  }

  // Whether parts are of two loops: one may be short.
  bool has_rows(const Sum& sum) const {
    return sum.commutes && sum.fused < sum.terms.size() && !is_known(sum, sum.terms[sum.fused - 1]);
  }
  // Whether parts may be stretches of the domain: those of an argmin, of which the first of equals is wanted.
  bool keeps_order(const Sum& sum) const {
    const auto is_one_loop = [&](int i) { return is_known(sum, i); };
    const size_t all = reduction_of(sum.stage).size();
    return sum.terms.size() == all && std::ranges::all_of(sum.terms, is_one_loop) &&
           sum.fused == sum.terms.size() &&
           prove_associative(*sum.func, sum.func->stage(sum.stage.id.stage)).op;
  }

  // The elements of a part, if data or the loops of the sum choose among them. 0: not known.
  int64_t elements_that_meet(const Sum& sum) const {
    int64_t elements = 1;
    for (size_t d = 0; d < sum.stage.write.index.size(); ++d) {
      const IndexForm& form = sum.stage.write.index[d];
      const bool is_own = !form.has_data() && form.terms.size() == 1 &&
                          sum.stage.iterators[static_cast<size_t>(form.terms[0].iterator)].kind ==
                              Iterator::Kind::Pure;
      if (is_own || (!form.has_data() && form.moved_by() == 0)) continue;
      const Extent e = sizes_.of(sum.stage.id.func, d);
      elements *= e.is_known() ? e.estimate : 0;
      if (elements == 0 || elements > device_.enough_threads() * terms_of_part) return 0;
    }
    return elements;
  }

  // 0: it is no such sum.
  int64_t parts_of(const Sum& sum) const {
    const int64_t terms = product(sum, sum.terms.size());
    if (sum.terms.empty() || sum.elements == 0 || sum.elements >= device_.few_threads() ||
        terms < device_.launch_terms)
      return 0;
    const int64_t meeting = elements_that_meet(sum);
    if (meeting == 0) return 0;
    const int64_t in_parts = has_rows(sum) ? terms : product(sum, sum.fused);
    const int64_t most = std::min(
        {device_.enough_threads() / sum.elements, terms / (terms_of_part * meeting), in_parts});
    if (most < least_parts || (!sum.commutes && !keeps_order(sum))) return 0;
    return static_cast<int64_t>(std::bit_floor(static_cast<uint64_t>(most)));
  }

  void split(const Sum& sum, int64_t count) const {
    SplitUpdate update(sum.func, sum.stage.id.stage);
    const auto name = [&](size_t term) {
      return sum.stage.iterators[static_cast<size_t>(sum.terms[term])].name;
    };
    std::string all = name(0);
    for (size_t i = 1; i < sum.fused; ++i) all = update.fuse(all, name(i));
    if (has_rows(sum)) {
      split_rows(update, all, name(sum.fused), count);
    } else {
      const std::string part = parts(update, sum, all, product(sum, sum.terms.size()), count);
      factor(update, {{part, "parts"}});
      if (count >= device_.launch_terms) {
        const std::string group = parts(update, sum, part, count, device_.block_threads());
        factor(update, {{group, "groups"}});
      }
    }
    update.finish();
  }
  // Partial sums over some points of some rows each, then over all rows.
  void split_rows(SplitUpdate& update, const std::string& all, const std::string& rows,
                  int64_t count) const {
    const int64_t points = std::min(count, device_.block_threads());
    const std::string part = update.split(all, "part", points);
    if (count == points) return factor(update, {{part, "parts"}});
    const std::string row = update.split(rows, "row", count / points);
    factor(update, {{part, "parts"}, {row, "rows"}});
    factor(update, {{part, "parts"}});
  }
  // Splits terms over parts: in turn if neighbours may take neighbours, else a stretch for each. The result: the loop over
  // parts.
  static std::string parts(const SplitUpdate& update, const Sum& sum, const std::string& all,
                           int64_t terms, int64_t count) {
    if (sum.commutes) return update.split(all, "part", count);
    return update.split_outside(all, "part", (terms + count - 1) / count);
  }
  // Partial results of the iterations of these loops, contiguous in memory.
  static void factor(SplitUpdate& update,
                     const std::vector<std::pair<std::string, std::string>>& loops) {
    const FuncPtr made = update.factor(loops);
    std::vector<std::string> layout(made->args.end() - static_cast<std::ptrdiff_t>(loops.size()),
                                    made->args.end());
    for (const std::string& arg : made->args) {
      if (std::ranges::find(layout, arg) == layout.end()) layout.push_back(arg);
    }
    made->schedule.storage_dims = layout;
  }
};

}  // namespace

void split_for_device(const std::vector<FuncPtr>& outputs, const SplitForDevice& how,
                      ir::FunctionRef<bool(const FuncContents&)> may_change) {
  DeviceSplitter(outputs, how).run(may_change);
}

}  // namespace retrograde::planning
