#include "autoschedule/search/search.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <unordered_set>

#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/nest.h"

namespace retrograde::planning {

namespace {

constexpr int sweeps = 2;
// A search of width 1 sweeps once over a program of more Funcs than this: its time would grow too much.
constexpr size_t many_funcs = 64;
constexpr double worth_another_sweep = 0.98;  // of the time before the last one
constexpr int moves_of_a_func = 2;            // one after another, in one visit
// Plans that go on within a visit although others are faster so far: the next move may gain more from them.
constexpr size_t spare_paths = 1;
constexpr int64_t prices_per_func = 200;  // for each plan of the beam
// A Func with a small share of the whole time is only computed elsewhere, or stored in another order, which its consumers
// may gain from; one with less is not visited.
constexpr double small_share = 0.01, smallest_share = 0.002;
// In programs of more Funcs, each has a smaller share: less is worth a visit or a change.
constexpr double funcs_for_shares = 100;
// A plan whose code is twice as long has to be faster by this power of 2. Only Funcs with a large share of the code are visited
// for it, once, when all is as fast as it gets.
constexpr double code_exponent = 0.05, large_code_share = 0.05;
double share_in(const AccessGraph& accesses, double share) {
  return share * std::min(1.0, funcs_for_shares / static_cast<double>(accesses.funcs().size()));
}

// A plan of the beam. Steps are a list that plans share, the last first.
struct State {
  struct Step {
    SearchStep step;
    std::shared_ptr<const Step> before;
  };
  Plan plan;
  uint64_t hash = 0;
  Cost cost;
  std::shared_ptr<const Step> last;
};

// Seconds, or these weighed with the time that compiling takes.
enum class Goal : uint8_t { Time, TimeAndCode };
double score_of(const Totals& cost, Goal goal) {
  const double weight = goal == Goal::Time ? 1 : std::pow(std::max(cost.code, 1.0), code_exponent);
  return cost.seconds * weight;
}
void sort_by(Goal goal, auto& states) {
  std::ranges::stable_sort(states, {},
                           [&](const State& state) { return score_of(state.cost, goal); });
}

// Whether the gain exceeds the error of the model, which is about the stages whose times differ.
bool is_worth_it(const Cost& before, const Cost& after, Goal goal, double least_gain,
                 double least_gain_of_all) {
  double changed = 0;
  auto was = before.stages.begin();
  for (const StageCost& stage : after.stages) {
    for (; was != before.stages.end() && was->stage < stage.stage; ++was) changed += was->seconds;
    const bool is_known = was != before.stages.end() && was->stage == stage.stage;
    const double seconds = is_known ? (was++)->seconds : 0;
    if (seconds != stage.seconds) changed += std::max(seconds, stage.seconds);
  }
  for (; was != before.stages.end(); ++was) changed += was->seconds;
  const double least = std::max(least_gain * changed, least_gain_of_all * before.seconds);
  return score_of(after, goal) < score_of(before, goal) * (1 - least / before.seconds);
}

bool is_alike(const FuncPlan& a, const FuncPlan& b) {
  return a.placement == b.placement && a.storage == b.storage;
}

FoundPlan found_of(const State& state) {
  FoundPlan found{state.plan, state.cost, {}};
  for (const State::Step* at = state.last.get(); at; at = at->before.get())
    found.steps.push_back(at->step);
  std::ranges::reverse(found.steps);
  return found;
}

// One beam search of a width.
class Beam {
 public:
  Beam(const Plan& start, const Context& context, CostModel& cost, const SearchOptions& options,
       int width)
      : context_(context),
        cost_(cost),
        options_(options),
        width_(static_cast<size_t>(width)),
        left_(prices_per_func * static_cast<int64_t>(start.funcs.size()) * width) {
    states_.push_back({start, hash_of(start), cost_.price(start), nullptr});
    seen_.insert(states_[0].hash);
    find_shares();
  }

  // The best plans, the fastest first: one more than the width, so that a descent tells what else was good.
  std::vector<State> run() {
    const bool sweeps_once = width_ == 1 && context_.accesses.funcs().size() > many_funcs;
    for (int sweep = 0; sweep < (sweeps_once ? 1 : sweeps); ++sweep) {
      const double before = states_[0].cost.seconds;
      for (auto f = static_cast<FuncId>(context_.accesses.funcs().size()); f-- > 0;) {
        if (is_worth_visiting(f)) visit(f);
      }
      if (states_[0].cost.seconds > worth_another_sweep * before) break;
    }
    if (!context_.device) shorten_code();
    return states_;
  }
  int64_t priced() const { return priced_; }

 private:
  Goal goal_ = Goal::Time;
  const Context& context_;
  CostModel& cost_;
  const SearchOptions& options_;
  const size_t width_;
  int64_t left_, priced_ = 1;
  std::unordered_set<uint64_t> seen_;
  std::vector<State> states_;  // the fastest first; never empty

  // By Func, the seconds that the fastest plan spends in its stages or, if it is inlined, in those that read it.
  std::vector<double> shares_;
  void find_shares() {
    shares_.assign(context_.accesses.funcs().size(), 0);
    for (const StageCost& stage : states_[0].cost.stages)
      shares_[static_cast<size_t>(stage.stage.func)] += stage.seconds;
    for (size_t f = shares_.size(); f-- > 0;) {
      if (shares_[f] > 0) continue;
      for (const StageId& reader : context_.accesses.consumers(static_cast<FuncId>(f)))
        shares_[f] += shares_[static_cast<size_t>(reader.func)];
    }
  }
  double share_of(FuncId f) const { return shares_[static_cast<size_t>(f)]; }
  // Kernels are cheap to price, and each launch that is saved counts.
  bool is_small(FuncId f) const {
    return !context_.device && share_of(f) < small_share * states_[0].cost.seconds;
  }
  bool is_worth_visiting(FuncId f) const {
    const auto i = static_cast<size_t>(f);
    if (i < options_.kept.size() && options_.kept[i]) return false;
    return context_.device ||
           share_of(f) >= share_in(context_.accesses, smallest_share) * states_[0].cost.seconds;
  }

  // Smaller bodies and fewer copies, which were not worth their time before.
  void shorten_code() {
    goal_ = Goal::TimeAndCode;
    seen_.clear();
    sort_by(goal_, states_);
    for (auto f = static_cast<FuncId>(context_.accesses.funcs().size()); f-- > 0;) {
      if (is_worth_visiting(f) && code_of(f) > large_code_share * states_[0].cost.code) visit(f);
    }
  }
  double code_of(FuncId f) const {
    double code = 0;
    for (const StageCost& stage : states_[0].cost.stages)
      if (stage.stage.func == f) code += stage.code;
    return code;
  }

  // A plan on the way from one of the states.
  struct Candidate : State {
    size_t from = 0;
  };

  void visit(FuncId f) {
    const std::vector<State> before = states_;
    const int most = is_small(f) ? 1 : moves_of_a_func;
    std::vector<Candidate> front;
    for (size_t i = 0; i < before.size(); ++i) front.push_back({before[i], i});
    for (int depth = 0; depth < most && !front.empty() && left_ > 0; ++depth) {
      std::vector<Candidate> next;
      for (const Candidate& from : front) add_neighbours(from, f, next);
      sort_by(goal_, next);
      if (next.size() > width_ + spare_paths) next.resize(width_ + spare_paths);
      bool is_better = false;
      for (Candidate& candidate : next) {
        candidate.cost = cost_.price(candidate.plan);
        if (!is_worth_it(before[candidate.from].cost, candidate.cost, goal_, options_.least_gain,
                         share_in(context_.accesses, options_.least_gain_of_all)))
          continue;
        is_better |= score_of(candidate.cost, goal_) < score_of(states_[0].cost, goal_);
        states_.push_back(candidate);
      }
      sort_by(goal_, states_);
      if (states_.size() > width_ + 1) states_.resize(width_ + 1);
      find_shares();
      // A step may make things worse once, at the beginning, where the next one makes up for it.
      if (depth > 0 && !is_better) break;
      front = std::move(next);
    }
  }

  void add_neighbours(const Candidate& from, FuncId f, std::vector<Candidate>& next) {
    const bool only_places = is_small(f);
    for (const Move& move : all_moves()) {
      const bool is_left_out = options_.without.contains(move.name) || !move.is_for(context_);
      if (is_left_out || (only_places && !move.may_place)) continue;
      for (Plan& plan : move.apply(from.plan, f, context_)) {
        if (left_ == 0) return;
        if (only_places && is_alike(plan.of(f), from.plan.of(f))) continue;
        const uint64_t hash = hash_of(plan, from.plan, from.hash);
        if (!keeps_funcs(from.plan, plan, options_) || !seen_.insert(hash).second) continue;
        --left_;
        ++priced_;
        const Totals cost = cost_.totals(plan);
        if (cost.peak_bytes > std::max(options_.most_bytes, from.cost.peak_bytes)) continue;
        const SearchStep step{f, move.name, cost.seconds};
        const auto last = std::make_shared<const State::Step>(State::Step{step, from.last});
        next.push_back({{std::move(plan), hash, {cost, {}}, last}, from.from});
      }
    }
  }
};

}  // namespace

namespace {

// Whether each stage has loops of its own, as they are defined, of which only those of rows are split: into vectors.
bool runs_along_rows(const graph::FuncContents& f, const FuncPlan& plan) {
  for (size_t s = 0; s < plan.nests.size(); ++s) {
    const Nest& nest = plan.nests[s];
    const std::optional<size_t> lanes = moves::vector_loop(nest);
    std::vector<int16_t> order, defined;
    for (size_t d = 0; d < nest.loops.size(); ++d) {
      if (nest.loops[d].kind == ForType::Unrolled) return false;
      if (!lanes || d != *lanes) order.push_back(nest.loops[d].iterator);
    }
    for (const Loop& loop : loops_of_definition(f, static_cast<int>(s)).loops)
      defined.push_back(loop.iterator);
    if (nest.shared_with || !nest.fusions.empty() || order != defined) return false;
  }
  return true;
}

}  // namespace

bool keeps_funcs(const Plan& before, const Plan& after, const SearchOptions& options) {
  const auto is_set = [](const std::vector<bool>& by_func, size_t f) {
    return f < by_func.size() && by_func[f];
  };
  for (size_t f = 0; f < before.funcs.size(); ++f) {
    const FuncPlan &was = *before.funcs[f], &is = *after.funcs[f];
    const bool is_alike = was.storage == is.storage && was.nests == is.nests;
    if (is_set(options.kept, f) && before.funcs[f] != after.funcs[f] && !is_alike) return false;
    if (is_set(options.at_root, f) && is.placement.compute.kind != Level::Kind::Root) return false;
    if (is_set(options.in_rows, f) && was.nests != is.nests &&
        !runs_along_rows(*after.program->funcs[f], is))
      return false;
  }
  return true;
}

SearchResult search(const Plan& start, const Context& context, CostModel& cost,
                    const SearchOptions& options) {
  SearchResult result;
  std::vector<State> found;
  const auto add = [&](int width) {
    Beam beam(start, context, cost, options, width);
    for (State& state : beam.run()) {
      const auto is_it = [&](const State& known) { return known.plan == state.plan; };
      if (std::ranges::none_of(found, is_it)) found.push_back(std::move(state));
    }
    result.priced += beam.priced();
  };
  add(1);
  if (options.width > 1) add(options.width);
  result.start = {start, cost.price(start), {}};
  // Results keep within the limit of memory. The start need not.
  const bool has_much = result.start.cost.peak_bytes > options.most_bytes;
  std::erase_if(found, [&](const State& state) {
    return state.cost.peak_bytes > options.most_bytes && !(has_much && state.plan == start);
  });
  sort_by(context.device ? Goal::Time : Goal::TimeAndCode, found);
  for (const State& state : found) result.found.push_back(found_of(state));
  return result;
}

void merge(SearchResult& result, SearchResult other) {
  for (FoundPlan& found : other.found) {
    const auto is_it = [&](const FoundPlan& known) { return known.plan == found.plan; };
    if (std::ranges::none_of(result.found, is_it)) result.found.push_back(std::move(found));
  }
  const auto seconds = [](const FoundPlan& found) { return found.cost.seconds; };
  std::ranges::stable_sort(result.found, std::less(), seconds);
  result.priced += other.priced;
}

}  // namespace retrograde::planning
