#include "graph/computing_order.h"

#include <algorithm>
#include <numeric>
#include <set>

namespace retrograde::graph {

namespace {

constexpr std::ptrdiff_t many_callees = 4;
constexpr size_t image_dimensions = 2;  // Funcs with fewer dimensions count as no memory
constexpr size_t most_outputs = 8;      // how many outputs are tried as the first
// Another order must keep at most this share of the graph's own order alive; otherwise the graph's
// order stays, because users expect it.
constexpr double worth_share = 0.9;

// A Func at root with all Funcs computed in its loops.
struct Nest {
  std::vector<size_t> funcs;  // in the order of the graph; last the one at root
  std::set<size_t> callees;   // indices of nests
  size_t dimensions = 0;
  bool is_output = false;

  bool takes_memory() const { return !is_output && dimensions >= image_dimensions; }
};
using Order = std::vector<size_t>;  // indices of nests

class Nests {
 public:
  explicit Nests(const std::vector<ComputedFunc>& funcs) : nest_of_(funcs.size()) {
    for (size_t f = 0; f < funcs.size(); ++f) {
      const size_t root = root_of(funcs, f);
      if (root == f) {
        nest_of_[f] = nests_.size();
        nests_.push_back({{}, {}, funcs[f].dimensions, funcs[f].is_output});
      }
    }
    for (size_t f = 0; f < funcs.size(); ++f) {
      nest_of_[f] = nest_of_[root_of(funcs, f)];
      Nest& nest = nests_[nest_of_[f]];
      nest.funcs.push_back(f);
      for (const size_t callee : funcs[f].callees)
        nest.callees.insert(nest_of_[root_of(funcs, callee)]);
    }
    for (size_t n = 0; n < nests_.size(); ++n) nests_[n].callees.erase(n);
  }

  // The order of the graph.
  Order own_order() const {
    Order order(nests_.size());
    std::iota(order.begin(), order.end(), size_t(0));
    return with_early(order);
  }
  // The order of the graph after the nests that `output` needs. Producers of a nest are visited in
  // the order of the graph, or in reverse.
  Order order_from(size_t output, bool is_last_first) const {
    Order order;
    std::vector<char> seen(nests_.size());
    visit(output, is_last_first, seen, order);
    for (size_t n = 0; n < nests_.size(); ++n) visit(n, false, seen, order);
    return with_early(order);
  }
  std::vector<size_t> outputs() const {
    std::vector<size_t> result;
    for (size_t n = 0; n < nests_.size(); ++n) {
      if (nests_[n].is_output) result.push_back(n);
    }
    return result;
  }

  // The largest number of images alive at once.
  size_t most_alive(const Order& order) const {
    std::vector<size_t> last(nests_.size());
    for (size_t p = 0; p < order.size(); ++p) {
      last[order[p]] = std::max(last[order[p]], p);
      for (const size_t callee : nests_[order[p]].callees) last[callee] = p;
    }
    std::vector<size_t> ends(order.size());
    size_t alive = 0, most = 0;
    for (size_t p = 0; p < order.size(); ++p) {
      if (nests_[order[p]].takes_memory()) {
        ++alive;
        ++ends[last[order[p]]];
      }
      most = std::max(most, alive);
      alive -= ends[p];
    }
    return most;
  }

  std::vector<size_t> funcs_in(const Order& order) const {
    std::vector<size_t> result;
    for (const size_t n : order)
      result.insert(result.end(), nests_[n].funcs.begin(), nests_[n].funcs.end());
    return result;
  }

 private:
  static size_t root_of(const std::vector<ComputedFunc>& funcs, size_t f) {
    for (size_t steps = 0; funcs[f].host && steps < funcs.size(); ++steps) f = *funcs[f].host;
    return f;
  }

  void visit(size_t n, bool is_last_first, std::vector<char>& seen, Order& order) const {
    if (seen[n]) return;
    seen[n] = 1;
    const auto visit_callee = [&](size_t callee) { visit(callee, is_last_first, seen, order); };
    const std::set<size_t>& callees = nests_[n].callees;
    if (is_last_first)
      std::for_each(callees.rbegin(), callees.rend(), visit_callee);
    else
      std::for_each(callees.begin(), callees.end(), visit_callee);
    order.push_back(n);
  }

  bool is_early(const Nest& nest) const {
    if (nest.is_output) return true;
    return std::ranges::count_if(nest.callees, [&](size_t callee) {
             return nests_[callee].takes_memory() && nests_[callee].dimensions >= nest.dimensions;
           }) >= many_callees;
  }

  Order with_early(const Order& base) const {
    Order order = base;
    std::vector<size_t> place(base.size());
    for (size_t p = 0; p < base.size(); ++p) {
      const Nest& nest = nests_[base[p]];
      size_t first = p;
      if (is_early(nest)) {
        first = 0;
        for (const size_t callee : nest.callees) first = std::max(first, place[callee] + 1);
      }
      for (size_t q = p; q > first; --q) {
        order[q] = order[q - 1];
        place[order[q]] = q;
      }
      order[first] = base[p];
      place[base[p]] = first;
    }
    return order;
  }

  std::vector<size_t> nest_of_;  // for each Func
  std::vector<Nest> nests_;
};

}  // namespace

std::vector<size_t> computing_order(const std::vector<ComputedFunc>& funcs) {
  const Nests nests(funcs);
  Order best = nests.own_order();
  double bound = worth_share * static_cast<double>(nests.most_alive(best));
  std::vector<size_t> outputs = nests.outputs();
  outputs.resize(std::min(outputs.size(), most_outputs));
  for (const size_t output : outputs) {
    for (const bool is_last_first : {false, true}) {
      Order order = nests.order_from(output, is_last_first);
      const auto alive = static_cast<double>(nests.most_alive(order));
      if (alive >= bound) continue;
      best = std::move(order);
      bound = alive;
    }
  }
  return nests.funcs_in(best);
}

}  // namespace retrograde::graph
