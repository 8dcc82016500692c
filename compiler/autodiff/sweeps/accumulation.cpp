#include "autodiff/sweeps/accumulation.h"

#include <algorithm>
#include <map>
#include <set>

#include "autodiff/sweeps/blocked_sums.h"
#include "autodiff/sweeps/gather_places.h"
#include "autodiff/sweeps/join_borders.h"
#include "autodiff/sweeps/local_derivative.h"
#include "autodiff/sweeps/regions.h"
#include "autoschedule/scatter_schedule.h"
#include "frontend/language/var.h"
#include "graph/define.h"
#include "graph/directive.h"
#include "graph/function.h"
#include "ir/build.h"
#include "ir/conjuncts.h"
#include "ir/equal.h"
#include "ir/print.h"
#include "ir/variables.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

// Parts of a privatised accumulation: enough for the threads of today's machines, few enough to sum
// and to store.
constexpr int part_count = 32;
// Setting parts to zero and summing them may cost as much as this many elements an iteration; with
// fewer parts than the least, a scatter stays one.
constexpr double elements_an_iteration = 4;
constexpr int least_parts = 4;
// Elements of a part's vector: neighbouring iterations accumulate apart.
constexpr int lane_count = 16;
// Elements of one part of a scatter, lanes included, that stay in a near cache.
constexpr double near_elements = 1 << 14;
// Bytes that all parts of one adjoint may take: what a large target has no room for is accumulated
// in place, in parallel over its pure dimensions only.
constexpr double private_bytes = 64 << 20;
// Below so many elements, with so many iterations each, the pure dimensions alone do not fill a
// machine: one tile of registers holds them, or a few do.
constexpr double one_tile = 64, few_elements = 1024, many_iterations = 4096, unknown_elements = 1e9;
// That a lane of a part adds up where there are several tiles, so that parts cost little beside it.
constexpr double terms_a_lane = 8;
// Iterations from which on lanes of their own are worth setting to zero and adding up.
constexpr double lanes_pay = 16 * lane_count;

bool is_pointwise(const Gather& g) {
  return !g.rdom && !g.scatters &&
         std::all_of(g.pure.begin(), g.pure.end(), [](bool p) { return p; });
}

// Conditions on ranges are true but for borders; those on residues are not.
bool is_range_condition(const Expr& e) {
  bool result = true;
  walk(e, [&](const Expr& node) {
    Kind k = node.kind();
    bool ordered =
        k == Kind::LT || k == Kind::LE || k == Kind::GT || k == Kind::GE || k == Kind::And;
    bool arithmetic =
        k == Kind::Add || k == Kind::Sub || k == Kind::Mul || k == Kind::Min || k == Kind::Max;
    const auto* call = node.as<Call>();
    bool marker = call && call->is_op(Op::likely);
    result &= ordered || arithmetic || marker || k == Kind::Variable || k == Kind::IntImm;
    return result;
  });
  return result;
}

// The conditions of a gather that fail in a border only: those on ranges, in which reduction
// variables move no further than a stencil does. Loops are cut there. What a wider reduction
// variable decides becomes the ends of its own loop (trim_loops).
constexpr double stencil_reach = 64;
bool fails_in_a_border(const Expr& e, const std::vector<ReductionVariable>& rvars) {
  if (!is_range_condition(e)) return false;
  return std::all_of(rvars.begin(), rvars.end(), [&](const ReductionVariable& r) {
    auto extent = as_const_int(r.extent);
    return !uses_variable(e, r.var) || (extent && static_cast<double>(*extent) <= stencil_reach);
  });
}
Expr with_likely_parts(const Expr& predicate, const std::vector<ReductionVariable>& rvars) {
  if (const auto* both = predicate.as<And>())
    return with_likely_parts(both->a, rvars) && with_likely_parts(both->b, rvars);
  return fails_in_a_border(predicate, rvars) ? likely(predicate) : predicate;
}

Expr masked(const Expr& predicate, const Expr& value) {
  if (!predicate.defined()) return value;
  Expr condition = is_range_condition(predicate) ? likely(predicate) : predicate;
  return make_select(condition, value, make_zero(value.type()));
}

// One place of an update, as one corner of a cell between which a pixel is read.
struct Tap {
  std::vector<Expr> place;
  std::vector<Expr> sums;  // one a value; undefined: nothing is added
};

// Contributions that can share one update definition.
struct UpdateGroup {
  Gather gather;          // of the first tap; all have its domain and predicate
  std::vector<Tap> taps;  // several in scatters only
};

// Whether elements between those that it reaches stay 0.
bool leaves_zeros(const Contribution& c) {
  bool everywhere =
      std::all_of(c.gather.pure.begin(), c.gather.pure.end(), [](bool p) { return p; });
  return !everywhere || (c.gather.predicate.defined() && !is_range_condition(c.gather.predicate));
}

void note_traits(const FuncPtr& f, const std::vector<Expr>& adjoints) {
  if (!f->made) return;
  for (const Expr& e : adjoints) {
    if (e.defined()) f->made->traits.add(traits_of(e));
  }
}

// What two gathers must agree on to share an update, with the reduction variables numbered. To be
// taps of one, scatters need not agree on the places that are no pure dimensions.
std::string shape_of(const Gather& g, bool with_places = true) {
  Substitution canonical;
  std::string key;
  if (g.rdom) {
    for (size_t i = 0; i < g.rdom->vars.size(); ++i) {
      canonical[g.rdom->vars[i].var] = variable("rho" + std::to_string(i));
      key += print(g.rdom->vars[i].min) + ":" + print(g.rdom->vars[i].extent) + ";";
    }
  }
  for (size_t d = 0; d < g.lhs.size(); ++d)
    key += with_places || g.pure[d] ? print(substitute(g.lhs[d], canonical)) + "," : "?,";
  if (g.predicate.defined()) key += "|" + print(substitute(g.predicate, canonical));
  return key;
}

Expr rename_rdom(const Expr& e, const Gather& from, const Gather& to) {
  if (!e.defined() || !from.rdom || from.rdom == to.rdom) return e;
  Substitution names;
  for (size_t i = 0; i < from.rdom->vars.size(); ++i) {
    names[from.rdom->vars[i].var] = variable(to.rdom->vars[i].var, Int(32), SymbolRef(to.rdom));
  }
  return substitute(e, names);
}

// Whether a gather sums a few terms, which its condition leaves out in borders alone.
bool has_borders(const Gather& g) {
  if (!g.rdom || g.scatters || !g.predicate.defined()) return false;
  double iterations = 1;
  for (const ReductionVariable& r : g.rdom->vars)
    iterations *= static_cast<double>(as_const_int(r.extent).value_or(many_terms));
  std::vector<Expr> conditions;
  add_conjuncts(g.predicate, conditions);
  return iterations < many_terms &&
         std::all_of(conditions.begin(), conditions.end(),
                     [&](const Expr& e) { return fails_in_a_border(e, g.rdom->vars); });
}

// Gathers over one domain that differ in their borders share an update: beyond its border each adds
// 0. Then what they sum is gone through once. Only a few: one body has all that they read.
constexpr size_t most_borders = 4;
std::vector<Contribution> share_domains(std::vector<Contribution> contributions) {
  const auto domain_of = [](Gather g) {
    g.predicate = Expr();
    return shape_of(g);
  };
  std::map<std::string, std::set<std::string>> borders;  // by domain
  for (const Contribution& c : contributions) {
    if (has_borders(c.gather)) borders[domain_of(c.gather)].insert(shape_of(c.gather));
  }
  for (Contribution& c : contributions) {
    if (!has_borders(c.gather)) continue;
    const size_t different = borders[domain_of(c.gather)].size();
    if (different < 2 || different > most_borders) continue;
    c.adjoint = masked(c.gather.predicate, c.adjoint);
    c.gather.predicate = Expr();
  }
  return contributions;
}

std::vector<UpdateGroup> group_updates(const std::vector<Contribution>& contributions,
                                       size_t values) {
  std::vector<UpdateGroup> groups;
  std::map<std::string, size_t> index;
  for (const Contribution& c : contributions) {
    if (is_pointwise(c.gather)) continue;
    const Gather& g = c.gather;
    auto [it, is_new] = index.try_emplace(shape_of(g), groups.size());
    if (is_new) groups.push_back({g, {{g.lhs, std::vector<Expr>(values)}}});
    UpdateGroup& group = groups[it->second];
    Expr& sum = group.taps[0].sums[static_cast<size_t>(c.component)];
    Expr term = rename_rdom(c.adjoint, g, group.gather);
    sum = sum.defined() ? sum + term : term;
  }
  return groups;
}

// Scatters over one domain become one update over its iterations and their taps, which share
// storage, the places' coordinates and what the terms have in common.
std::vector<UpdateGroup> join_taps(const std::vector<UpdateGroup>& groups) {
  std::vector<UpdateGroup> joined;
  std::map<std::string, size_t> open;
  for (const UpdateGroup& group : groups) {
    if (!group.gather.scatters || !group.gather.rdom) {
      joined.push_back(group);
      continue;
    }
    auto [it, is_new] = open.try_emplace(shape_of(group.gather, false), joined.size());
    if (!is_new && joined[it->second].taps.size() >= most_taps) {
      it->second = joined.size();
      is_new = true;
    }
    if (is_new) {
      joined.push_back(group);
      continue;
    }
    UpdateGroup& all = joined[it->second];
    Tap tap = group.taps[0];
    const auto rename = [&](Expr& e) { e = rename_rdom(e, group.gather, all.gather); };
    std::for_each(tap.place.begin(), tap.place.end(), rename);
    std::for_each(tap.sums.begin(), tap.sums.end(), rename);
    all.taps.push_back(std::move(tap));
  }
  return joined;
}

// The value of the tap that `tap` numbers; one for all where they agree.
Expr of_tap(const Expr& tap, const std::vector<Expr>& values) {
  Expr result = values.back();
  for (size_t i = values.size() - 1; i-- > 0;) {
    if (!equal(values[i], values.back())) {
      for (size_t j = values.size() - 1; j-- > 0;)
        result = make_select(tap == static_cast<int>(j), values[j], result);
      return result;
    }
  }
  return result;
}

// One update: its iterations, with the taps as the last loop where there are several, and what each
// does. `over` is the gather, or scatter, of the first tap.
struct Iterations {
  Gather over;
  std::vector<ReductionVariable> rvars;
  bool has_taps = false;
  Tap all;
  Expr predicate;
};

Iterations over_taps(const UpdateGroup& group) {
  const Gather& g = group.gather;
  Iterations result{g, g.rdom ? g.rdom->vars : std::vector<ReductionVariable>(), false,
                    group.taps[0], g.predicate};
  if (group.taps.size() == 1) return result;
  const auto rdom = std::make_shared<ReductionDomainContents>();
  const Expr count = make_const(Int(32), static_cast<int64_t>(group.taps.size()));
  result.has_taps = true;
  result.rvars.push_back({unique_name("tap"), make_zero(Int(32)), count});
  rdom->vars = result.rvars;
  rdom->frozen = true;
  Substitution here;
  for (const ReductionVariable& r : g.rdom->vars)
    here[r.var] = variable(r.var, Int(32), SymbolRef(rdom));
  const Expr number = variable(rdom->vars.back().var, Int(32), SymbolRef(rdom));
  const auto choose = [&](const auto& part) {
    std::vector<Expr> values;
    for (const Tap& tap : group.taps) values.push_back(part(tap));
    return substitute(of_tap(number, values), here);
  };
  for (size_t d = 0; d < result.all.place.size(); ++d)
    result.all.place[d] = choose([&](const Tap& tap) { return tap.place[d]; });
  for (size_t k = 0; k < result.all.sums.size(); ++k) {
    const auto some = std::find_if(group.taps.begin(), group.taps.end(),
                                   [&](const Tap& tap) { return tap.sums[k].defined(); });
    if (some == group.taps.end()) continue;
    const Expr nothing = make_zero(some->sums[k].type());
    result.all.sums[k] =
        choose([&](const Tap& tap) { return tap.sums[k].defined() ? tap.sums[k] : nothing; });
  }
  if (result.predicate.defined()) result.predicate = substitute(result.predicate, here);
  return result;
}

bool has_pure_dimension(const Gather& g) {
  return std::find(g.pure.begin(), g.pure.end(), true) != g.pure.end();
}

class Builder {
 public:
  Builder(const AdjointTarget& target, const std::string& name)
      : target_(target),
        name_(claim_name(name)),
        types_(target.types),
        args_(variables_of(target.args)) {}

  AdjointFunc build(const std::vector<Contribution>& contributions,
                    const std::vector<Expr>& initial) {
    std::vector<UpdateGroup> groups = group_updates(contributions, types_.size());
    bool is_long = std::any_of(groups.begin(), groups.end(), [&](const UpdateGroup& group) {
      return sums_many_terms(group.gather);
    });
    if (is_long) widen();
    result_.func = new_func(is_wide_ ? claim_name(name_ + "_sum") : name_,
                            is_wide_ ? Role::Accumulator : Role::Adjoint);
    define_pointwise(contributions, initial);
    note_traits(result_.func, initial);
    estimate(result_.func);
    for (const Contribution& c : contributions) {
      note_traits(result_.func, {c.adjoint});
      if (leaves_zeros(c)) result_.func->made->traits.masked = true;
    }
    for (const UpdateGroup& group : join_taps(groups)) {
      const Iterations update = over_taps(group);
      is_worth_splitting(update) ? add_privatised(update) : add_update(update);
    }
    if (is_wide_) round_once();
    return std::move(result_);
  }

 private:
  FuncPtr new_func(const std::string& name, Role role = Role::Adjoint) const {
    FuncPtr f = make_func(role);
    f->made->of = target_.name;
    f->name = name;
    return f;
  }

  // How far the dimensions of the target run, where that is known: a guess as users give them.
  void estimate(const FuncPtr& f) const {
    if (target_.region.size() != target_.args.size()) return;
    for (size_t d = 0; d < target_.args.size(); ++d) {
      const LoopVariable& v = target_.region[d];
      const bool is_known = v.min.defined() && v.max.defined() && extent_of(v) < unknown_elements;
      if (!is_known || std::find(f->args.begin(), f->args.end(), target_.args[d]) == f->args.end())
        continue;
      f->schedule.estimates.push_back(
          {target_.args[d], simplify(v.min), simplify(v.max - v.min + 1), {}, {}});
    }
  }

  // ---- long sums ----

  void widen() {
    for (Type& t : types_) {
      is_wide_ |= t.bits() < 64;
      t = Float(64, t.lanes());
    }
  }
  void round_once() {
    result_.accumulator = result_.func;
    result_.helpers.push_back(result_.accumulator);
    result_.func = new_func(name_);
    std::vector<Expr> values;
    for (size_t k = 0; k < types_.size(); ++k) {
      values.push_back(
          cast_to(target_.types[k], call_value(result_.accumulator, args_, static_cast<int>(k))));
    }
    define_pure(result_.func, args_, values);
    note_traits(result_.func, values);
  }

  // Whether an element may get many terms. Data may send all iterations of a scatter to one.
  bool sums_many_terms(const Gather& g) const {
    return g.rdom && (is_few_elements(g) || iterations_of(g, many_terms) >= many_terms);
  }

  // ---- definitions ----

  void define_pointwise(const std::vector<Contribution>& contributions,
                        const std::vector<Expr>& initial) {
    std::vector<Expr> values(types_.size());
    for (size_t k = 0; k < initial.size(); ++k) values[k] = initial[k];
    for (const Contribution& c : contributions) {
      if (!is_pointwise(c.gather)) continue;
      Expr& value = values[static_cast<size_t>(c.component)];
      Expr term = masked(c.gather.predicate, c.adjoint);
      value = value.defined() ? value + term : term;
    }
    for (size_t k = 0; k < values.size(); ++k) {
      values[k] = values[k].defined() ? cast_to(types_[k], values[k]) : make_zero(types_[k]);
    }
    define_pure(result_.func, args_, values);
    result_.stages.push_back(Accumulation::Pointwise);
  }

  // Whether the terms are added in float32 blocks before they come to a sum in double. Data may
  // send whatever they like to an element of a scatter.
  bool has_blocks(const Iterations& update) const {
    return is_wide_ && !update.over.scatters && sums_many_terms(update.over) &&
           std::all_of(target_.types.begin(), target_.types.end(),
                       [](Type t) { return t == Float(32); });
  }
  // Has terms added up by a block, where there is one, so that the rest of the update adds blocks.
  void take_blocks(const std::vector<Expr>& point, int lanes, std::vector<ReductionVariable>& rvars,
                   std::vector<Expr>& terms, Expr& predicate) {
    const auto sum = sum_in_blocks(name_, target_.name, point, rvars, terms, predicate);
    if (!sum) return;
    sum->block->made->lanes = lanes;
    estimate(sum->block);
    result_.helpers.push_back(sum->block);
    rvars = sum->rvars;
    terms = sum->values;
    predicate = Expr();
  }

  void add_update(const Iterations& update) {
    auto [place, sums] = update.all;
    std::vector<ReductionVariable> rvars = update.rvars;
    Expr predicate;
    if (rvars.empty()) {
      for (Expr& term : sums) {
        if (term.defined()) term = masked(update.predicate, term);
      }
    } else if (update.predicate.defined()) {
      predicate = with_likely_parts(update.predicate, rvars);
    }
    if (has_blocks(update))
      take_blocks(parts_point(update.over, args_, {}, {}), 0, rvars, sums, predicate);
    std::vector<Expr> values;
    for (size_t k = 0; k < types_.size(); ++k) {
      Expr self = call_value(result_.func, place, static_cast<int>(k));
      values.push_back(sums[k].defined() ? self + cast_to(self.type(), sums[k]) : self);
    }
    append_update(result_.func, place, values, rvars, predicate);
    result_.stages.push_back(update.over.scatters ? Accumulation::Scatter : Accumulation::Gather);
  }

  // Whether the elements alone give too little to do in parallel, and each sums over many
  // iterations.
  bool is_worth_splitting(const Iterations& update) const {
    const Gather& g = update.over;
    return g.rdom && (leaves_lanes_idle(update) || is_few_elements(g));
  }
  bool is_few_elements(const Gather& g) const {
    if (elements_of(g) > few_elements) return false;
    if (parts_of(g) < least_parts) return false;
    double iterations = iterations_of(g, many_iterations);
    return iterations >= (has_pure_dimension(g) ? many_iterations : part_count * lane_count);
  }
  // Whether vectors of elements are worse than vectors of terms: rows of elements are shorter than
  // one, as in a small kernel with many channels, or lie across what is read, as in a layer that
  // mixes channels; while each element sums over long rows.
  bool leaves_lanes_idle(const Iterations& update) const {
    const Gather& g = update.over;
    if (g.scatters || g.pure.empty() || target_.region.size() != g.pure.size()) return false;
    const auto row = as_const_int(g.rdom->vars[0].extent);
    const bool is_short = extent_of(target_.region[0]) * 2 <= lane_count;
    return g.pure[0] && (is_short || reads_across(update)) && (!row || *row >= lane_count) &&
           elements_of(g) <= near_elements && iterations_of(g, many_iterations) >= lanes_pay;
  }
  // Whether all that is read for neighbouring elements lies apart, and that for neighbouring terms
  // together.
  bool reads_across(const Iterations& update) const {
    const std::string &row = target_.args[0], &term = update.rvars[0].var;
    bool along = false, across = false;
    const auto note = [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (!call || call->call_type == CallType::Operator || call->args.empty()) return true;
      along |= uses_variable(call->args[0], row);
      across |= uses_variable(call->args[0], term) &&
                std::any_of(call->args.begin() + 1, call->args.end(),
                            [&](const Expr& arg) { return uses_variable(arg, row); });
      return true;
    };
    for (const Expr& sum : update.all.sums) {
      if (sum.defined()) walk(sum, note);
    }
    return across && !along;
  }
  // Each part of a scatter holds every element that it may reach: the more elements for the
  // iterations, the fewer parts. A power of two. One: there are only lanes. Where sizes are known
  // at run time only, the most there may be.
  int parts_of(const Gather& g) const {
    if (!g.scatters && elements_of(g) > few_elements) return 1;
    if (!g.scatters && elements_of(g) > one_tile) return parts_of_a_tile(g);
    if (!g.scatters || target_.region.size() != g.pure.size()) return part_count;
    const double elements = elements_of_target();
    if (elements >= unknown_elements) return part_count;
    const double most = iterations_of(g, many_iterations) * elements_of(g) * elements_an_iteration /
                        std::max(elements, 1.0);
    int parts = part_count;
    while ((parts > most || parts * elements * bytes_an_element() > private_bytes) && parts > 1)
      parts /= 2;
    return parts;
  }
  // Parts for the threads of elements that a few tiles of registers hold: each has lanes of its own
  // for every element, which are set to zero and added up.
  int parts_of_a_tile(const Gather& g) const {
    int parts = part_count;
    while (parts > 1 && iterations_of(g, many_iterations) < parts * lane_count * terms_a_lane)
      parts /= 2;
    return parts;
  }
  double bytes_an_element() const {
    double bytes = 0;
    for (Type t : types_) bytes += t.bytes();
    return bytes;
  }
  // `parts_of`, or as many of them as fit at run time.
  Expr part_count_of(const Gather& g) const {
    const Expr most = make_const(Int(32), parts_of(g));
    if (!g.scatters || target_.region.size() != g.pure.size() ||
        elements_of_target() < unknown_elements)
      return most;
    Expr fit = make_const(Int(64), static_cast<int64_t>(private_bytes / bytes_an_element()));
    for (const LoopVariable& v : target_.region) {
      if (!v.min.defined() || !v.max.defined()) return most;
      fit = fit / max(cast_to(Int(64), v.max - v.min + 1), make_one(Int(64)));
    }
    return simplify(cast_to(Int(32), min(max(fit, make_one(Int(64))), cast_to(Int(64), most))));
  }
  // Lanes let a gather add in vectors. In a scatter, neighbouring iterations often meet in one
  // element, and would wait for each other: lanes have elements of their own where these are few.
  bool has_lanes(const Gather& g) const {
    if (!g.scatters) return true;
    if (target_.region.size() != g.pure.size()) return false;
    const double elements = elements_of_target() * lane_count;
    const double iterations = iterations_of(g, many_iterations) * elements_of(g);
    return elements <= near_elements && elements * parts_of(g) <= iterations;
  }
  double elements_of_target() const {
    double elements = 1;
    for (const LoopVariable& v : target_.region) elements *= extent_of(v);
    return elements;
  }
  // A loop of unknown extent counts as `unknown` iterations.
  static double iterations_of(const Gather& g, double unknown) {
    double iterations = 1;
    for (const ReductionVariable& r : g.rdom->vars) {
      auto extent = as_const_int(r.extent);
      iterations *= extent ? static_cast<double>(*extent) : unknown;
    }
    return iterations;
  }
  // Elements that the pure dimensions of the update run over; a great many when unknown.
  double elements_of(const Gather& g) const {
    double elements = 1;
    for (size_t d = 0; d < g.pure.size(); ++d) {
      if (!g.pure[d]) continue;
      if (target_.region.size() != g.pure.size()) return unknown_elements;
      elements *= extent_of(target_.region[d]);
    }
    return elements;
  }
  static double extent_of(const LoopVariable& v) {
    auto extent = v.min.defined() && v.max.defined() ? as_const_int(simplify(v.max - v.min + 1))
                                                     : std::nullopt;
    return extent ? static_cast<double>(*extent) : unknown_elements;
  }

  // One slice of the reduction domain, in which lane and part are fixed.
  struct Slice {
    std::vector<ReductionVariable> rvars;
    Substitution place;            // reduction variable of the gather -> its value
    std::vector<Expr> conditions;  // inside the domain
  };

  // x = (part * chunk + rho) * lanes + lane for the outermost variable when it is the innermost
  // too; else lanes split the innermost and parts the outermost variable. Without `lane` there are
  // no lanes, without `part` no parts. Beyond the end the place is clamped: what it reads must
  // exist even where the condition is false. Both are cut off the steady state, whose accumulators
  // stay in registers.
  Slice slice_of(const Iterations& update, const Expr& lane, const Expr& part,
                 const Expr& parts) const {
    Slice slice;
    slice.rvars = update.rvars;
    auto rdom = std::make_shared<ReductionDomainContents>();
    const size_t last = slice.rvars.size() - (update.has_taps ? 2 : 1);
    for (size_t i = 0; i < slice.rvars.size(); ++i) {
      ReductionVariable& r = slice.rvars[i];
      std::string old = r.var;
      Expr all = r.extent, min = r.min;
      r = {unique_name(old), make_zero(Int(32)), all};
      const bool in_parts = i == last && part.defined(), in_lanes = i == 0 && lane.defined();
      if (in_lanes) r.extent = simplify((r.extent + (lane_count - 1)) / lane_count);
      if (in_parts) r.extent = simplify((r.extent + (parts - 1)) / parts);
      if ((in_parts || in_lanes) && has_blocks(update)) r.extent = in_whole_blocks(r.extent);
      Expr at = variable(r.var, Int(32), SymbolRef(rdom));
      if (in_parts) at = part * r.extent + at;
      if (in_lanes) at = at * lane_count + lane;
      if (in_parts || in_lanes) {
        slice.conditions.push_back(likely(at < all));
        at = min_of(likely(at), all - 1);
        if (!as_const_int(all)) at = max(at, make_zero(Int(32)));  // it may be 0
      }
      slice.place[old] = min + at;
    }
    rdom->vars = slice.rvars;
    rdom->frozen = true;
    return slice;
  }
  static Expr min_of(const Expr& a, const Expr& b) { return binary(Kind::Min, a, b); }

  // parts(lane, y..., part) accumulates a slice of the reduction domain; then adj(y...) sums over
  // lanes and parts. Elements fixed on the left-hand side need no y.
  void add_privatised(const Iterations& update) {
    const Gather& g = update.over;
    FuncPtr parts = new_func(claim_name(name_ + "_parts"), Role::Accumulator);
    Expr part = parts_of(g) > 1 ? variable(unique_name("part")) : Expr(),
         lane = has_lanes(g) ? variable(unique_name("lane")) : Expr();
    std::vector<Expr> zeros;
    for (Type t : types_) zeros.push_back(make_zero(t));
    define_pure(parts, parts_point(g, args_, lane, part), zeros);
    estimate(parts);
    if (lane.defined()) parts->made->lanes = lane_count;

    const Expr count = part_count_of(g);
    parts->made->has_parts = part.defined();
    Slice slice = slice_of(update, lane, part, count);
    const auto& [place, sums] = update.all;
    if (update.predicate.defined()) {
      slice.conditions.push_back(
          substitute(with_likely_parts(update.predicate, update.rvars), slice.place));
    }
    std::vector<Expr> element, terms;
    for (const Expr& e : place) element.push_back(substitute(e, slice.place));
    for (const Expr& sum : sums)
      terms.push_back(sum.defined() ? substitute(sum, slice.place) : sum);
    Expr predicate = conjunction(slice.conditions);
    const std::vector<Expr> lhs = parts_point(g, element, lane, part);
    if (has_blocks(update)) take_blocks(lhs, parts->made->lanes, slice.rvars, terms, predicate);
    std::vector<Expr> values;
    for (size_t k = 0; k < types_.size(); ++k) {
      Expr self = call_value(parts, lhs, static_cast<int>(k));
      values.push_back(terms[k].defined() ? self + cast_to(self.type(), terms[k]) : self);
    }
    append_update(parts, lhs, values, slice.rvars, predicate);
    result_.helpers.push_back(parts);
    sum_parts(g, parts, lane.defined(), count);
    note_parts(g, count);
  }
  void note_parts(const Gather& g, const Expr& count) {
    const double bytes = elements_of_target() * bytes_an_element();
    if (!g.scatters || as_const_int(count) == 1) return;
    const std::string number = is_const(count) ? print(count) : text("at most ", parts_of(g));
    const std::string each =
        bytes >= unknown_elements ? "" : text(" of ", static_cast<int64_t>(bytes), " bytes each");
    result_.notes.push_back(text("accumulated in ", number, " private parts", each,
                                 ", as many as fit ", static_cast<int64_t>(private_bytes),
                                 " bytes"));
  }

  // Coordinates of `parts`: the lane, the elements that a scatter reaches or the pure ones, the
  // part; lane and part where they are defined.
  static std::vector<Expr> parts_point(const Gather& g, const std::vector<Expr>& element,
                                       const Expr& lane, const Expr& part) {
    std::vector<Expr> point;
    if (lane.defined()) point.push_back(lane);
    for (size_t d = 0; d < element.size(); ++d) {
      if (g.scatters || g.pure[d]) point.push_back(element[d]);
    }
    if (part.defined()) point.push_back(part);
    return point;
  }

  void sum_parts(const Gather& g, const FuncPtr& parts, bool has_lanes, const Expr& count) {
    auto rdom = std::make_shared<ReductionDomainContents>();
    if (has_lanes)
      rdom->vars.push_back(
          {unique_name("lane"), make_zero(Int(32)), make_const(Int(32), lane_count)});
    const bool has_parts = parts_of(g) > 1;
    if (has_parts) rdom->vars.push_back({unique_name("part"), make_zero(Int(32)), count});
    rdom->frozen = true;
    auto rvar = [&](size_t i) { return variable(rdom->vars[i].var, Int(32), SymbolRef(rdom)); };
    const std::vector<Expr>& lhs = g.scatters ? args_ : g.lhs;
    std::vector<Expr> point = parts_point(g, lhs, has_lanes ? rvar(0) : Expr(),
                                          has_parts ? rvar(rdom->vars.size() - 1) : Expr());
    std::vector<Expr> values;
    for (size_t k = 0; k < types_.size(); ++k) {
      values.push_back(call_value(result_.func, lhs, static_cast<int>(k)) +
                       call_value(parts, point, static_cast<int>(k)));
    }
    append_update(result_.func, lhs, values, rdom->vars, {});
    result_.stages.push_back(Accumulation::Privatised);
  }

  const AdjointTarget& target_;
  std::string name_;
  std::vector<Type> types_;  // in which to accumulate
  bool is_wide_ = false;     // wider than the target's
  std::vector<Expr> args_;
  AdjointFunc result_;
};

}  // namespace

Expr call_value(const FuncPtr& f, const std::vector<Expr>& args, int index) {
  return call_func(f->name, f->types.at(static_cast<size_t>(index)), args, index, SymbolRef(f));
}

namespace {

// Of this definition only: an adjoint may get hundreds of them.
void freeze_callees(const Definition& d, const FuncContents& f) {
  walk(d, [&](const Call& call) {
    const FuncPtr callee = call.call_type == CallType::Func ? func_of(call) : nullptr;
    if (callee && callee.get() != &f) callee->frozen = true;
  });
}

}  // namespace

void append_update(const FuncPtr& f, std::vector<Expr> args, std::vector<Expr> values,
                   const std::vector<ReductionVariable>& rvars, Expr predicate) {
  Definition update;
  note_traits(f, values);
  for (Expr& e : args) e = cast_to(Int(32), e);
  update.args = std::move(args);
  update.values = std::move(values);
  update.rvars = rvars;
  if (predicate.defined() && !is_const_true(predicate)) update.predicate = predicate;
  update = map_exprs(update, [&](const Expr& e) { return redirect_calls(e, f, f, true); });
  update.schedule.dims = first_loops(*f, update);
  freeze_callees(update, *f);
  f->updates.push_back(std::move(update));
  f->version++;
}

AdjointFunc make_adjoint(const AdjointTarget& target, const std::string& name,
                         const std::vector<Contribution>& given, const std::vector<Expr>& initial) {
  std::vector<Contribution> contributions = given;
  join_borders(contributions, target);
  contributions = share_domains(std::move(contributions));
  for (Contribution& c : contributions) c.gather = with_safe_places(c.gather, target);
  return Builder(target, name).build(contributions, initial);
}

}  // namespace retrograde::ir
