#include "autodiff/report/operation_count.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "transform/stored_funcs.h"
#include "autodiff/sums/distinct_nodes.h"
#include "autodiff/sweeps/factored_program.h"
#include "autodiff/sweeps/local_derivative.h"
#include "autodiff/sweeps/regions.h"
#include "diagnostics/error.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "simplify/simplify.h"
#include "transform/cost_estimate.h"

namespace retrograde::autodiff {

namespace {

std::string number_text(double value) {
  bool is_integer = value == std::floor(value) && std::abs(value) < 1e15;
  return is_integer ? std::to_string(static_cast<int64_t>(value)) : text(value);
}

// One iteration of a stage, or one value of a Func: its own work, and the Funcs that it reads.
struct Body {
  Operations own;
  std::vector<const Call*> reads;  // of Funcs
  std::vector<Expr> kept_alive;
};

Body body_of(const std::vector<Expr>& roots) {
  std::vector<Expr> plain;
  for (const Expr& root : roots) {
    if (root.defined()) plain.push_back(without_lets(root));
  }
  const DistinctNodes distinct(plain);
  Body body;
  for (const Expr& node : distinct.nodes()) {
    const Work work = work_of(node);
    body.own += {.adds = static_cast<double>(work.adds),
                 .mults = static_cast<double>(work.mults),
                 .nonlinear = static_cast<double>(work.functions)};
    const auto* call = node.as<Call>();
    if (!call || call->call_type == CallType::Operator) continue;
    if (call->call_type == CallType::Func) {
      body.reads.push_back(call);
    } else {
      body.own.moves += 1;
    }
  }
  body.kept_alive = distinct.nodes();
  return body;
}

std::map<const Symbol*, Box> regions_of(const std::vector<WantedFunc>& outputs) {
  std::map<const Symbol*, Box> result;
  for (const WantedFunc& wanted : outputs) {
    Box& box = result[wanted.func.get()];
    box = hull(box, wanted.region);
  }
  return result;
}

class Counter {
 public:
  explicit Counter(const std::vector<WantedFunc>& outputs)
      : outputs_(mapped(outputs, &WantedFunc::func)),
        order_(topological_order(outputs_)),
        regions_(order_, regions_of(outputs)) {
    for (const FuncPtr& f : stored_by_default(outputs_)) stored_by_default_.insert(f.get());
  }

  OperationCount run() {
    for (const FuncPtr& f : order_) count(f);
    for (auto f = result_.funcs.rbegin(); f != result_.funcs.rend(); ++f) count_evaluations(*f);
    return std::move(result_);
  }

 private:
  bool is_stored(const FuncPtr& f) const {
    return !f->is_pure() || stored_by_default_.contains(f.get()) ||
           f->schedule.compute_level.kind != graph::LoopLevel::Kind::Inlined ||
           std::ranges::find(outputs_, f) != outputs_.end();
  }

  void count(const FuncPtr& f) {
    FuncOperations entry{f, regions_.of(f.get()), is_stored(f), {}, {}, {}, f->is_extern()};
    if (entry.stored) {
      entry.evaluations = elements(entry);
      entry.bytes = entry.evaluations * total_bytes(f->types);
    }
    for (int s = 0; s < f->stage_count(); ++s) entry.stages.push_back(count_stage(entry, s));
    if (f->made && !f->made->work.empty()) count_work(entry, f->made->work);
    if (!entry.stored) {
      for (const Expr& value : f->pure->values)
        value_costs_[f.get()].push_back(with_reads(body_of({value})));
    }
    places_[f.get()] = result_.funcs.size();
    result_.funcs.push_back(std::move(entry));
  }

  // Zero if the region is empty, that is, never read.
  static Count elements(const FuncOperations& f) {
    return f.region.empty() && f.func->dimensions() > 0 ? Count() : Count::points(f.region);
  }

  StageOperations count_stage(const FuncOperations& entry, int s) {
    const FuncContents& f = *entry.func;
    if (f.is_extern()) return {};
    const Definition& definition = f.stage(s);
    std::vector<Expr> roots = definition.values;
    append(roots, definition.args);
    roots.push_back(definition.predicate);
    StageOperations stage{with_reads(add_body(f, roots)), {}};
    if (!entry.stored) return stage;
    stage.each.moves += static_cast<double>(definition.values.size());
    if (entry.region.empty() && f.dimensions() > 0) return stage;
    stage.iterations = Count::points(mapped(regions_.domain(f, s).vars, &LoopVariable::range));
    return stage;
  }

  // A last update that follows a table of actions: counts each action by its own work.
  void count_work(FuncOperations& entry, const std::vector<AdjointWork>& work) {
    entry.stages.pop_back();
    bodies_[entry.func.get()].pop_back();
    double values = static_cast<double>(entry.func->types.size());
    for (const AdjointWork& part : work) {
      StageOperations stage{with_reads(add_body(*entry.func, part.values)), {}};
      stage.each.moves += static_cast<double>(part.values.size()) * values / (1 + values);
      Box box = regions_.of(entry.func.get());
      box.pop_back();  // the slot
      for (const Expr& extent : part.loops) box.push_back({Expr(0), extent - 1});
      stage.iterations = Count::points(box);
      entry.stages.push_back(stage);
    }
  }

  const Body& add_body(const FuncContents& f, const std::vector<Expr>& roots) {
    return bodies_[&f].emplace_back(body_of(roots));
  }

  Operations with_reads(const Body& body) const {
    Operations result = body.own;
    for (const ElementRead& read : elements_of(body)) {
      auto inlined = value_costs_.find(read.call->symbol.raw());
      if (inlined == value_costs_.end()) {
        result.moves += static_cast<double>(read.components.size());
      } else if (read.components.size() == 1) {
        result += inlined->second.at(*read.components.begin());
      } else {
        result += cost_together(*func_of(*read.call), read.components);
      }
    }
    return result;
  }

  // The cost of several values of an inlined Func at one element.
  Operations cost_together(const FuncContents& f, const std::set<size_t>& components) const {
    const std::pair key(&f, components);
    const auto known = costs_together_.find(key);
    if (known != costs_together_.end()) return known->second;
    std::vector<Expr> values;
    for (const size_t k : components) values.push_back(f.pure->values[k]);
    const Operations cost = with_reads(body_of(values));
    costs_together_.emplace(key, cost);
    return cost;
  }

  // The values that are read of one element, which share what they have in common.
  struct ElementRead {
    const Call* call;
    std::set<size_t> components;
  };
  static std::vector<ElementRead> elements_of(const Body& body) {
    std::vector<ElementRead> result;
    for (const Call* call : body.reads) {
      const auto found = std::ranges::find_if(result, [&](const ElementRead& read) {
        return read.call->symbol.raw() == call->symbol.raw() &&
               same_args(read.call->args, call->args);
      });
      ElementRead& read =
          found == result.end() ? result.emplace_back(ElementRead{call, {}}) : *found;
      read.components.insert(static_cast<size_t>(call->component));
    }
    return result;
  }

  // Called for consumers first: the evaluations of `entry` are known, and determine those of its producers.
  void count_evaluations(FuncOperations& entry) {
    const std::vector<Body>& bodies = bodies_[entry.func.get()];
    for (size_t s = 0; s < bodies.size(); ++s) {
      const Count& runs = entry.stored ? entry.stages[s].iterations : entry.evaluations;
      for (const Call* call : bodies[s].reads) {
        FuncOperations& callee = result_.funcs[places_.at(call->symbol.raw())];
        if (!callee.stored) callee.evaluations += runs;
      }
    }
  }

  std::vector<FuncPtr> outputs_, order_;
  Regions regions_;
  std::unordered_set<const FuncContents*> stored_by_default_;
  std::unordered_map<const Symbol*, std::vector<Operations>> value_costs_;  // of inlined Funcs
  mutable std::map<std::pair<const FuncContents*, std::set<size_t>>, Operations> costs_together_;
  std::unordered_map<const Symbol*, std::vector<Body>> bodies_;  // one for each entry of stages
  std::unordered_map<const Symbol*, size_t> places_;
  OperationCount result_;
};

}  // namespace

Operations& Operations::operator+=(const Operations& other) {
  moves += other.moves;
  adds += other.adds;
  mults += other.mults;
  nonlinear += other.nonlinear;
  return *this;
}

Count Count::points(const Box& box) {
  double factor = 1;
  std::vector<std::string> symbols;
  Count unknown;
  unknown.unknown_ = true;
  for (const Interval& i : box) {
    if (!i.is_bounded()) return unknown;
    Expr extent = extent_of(i);
    if (auto constant = as_const_int(extent)) {
      factor *= static_cast<double>(std::max<int64_t>(*constant, 0));
    } else {
      symbols.push_back(ir::print(extent));
    }
  }
  if (symbols.empty()) return factor;
  std::ranges::sort(symbols);
  std::string product;
  for (const std::string& s : symbols) product += (product.empty() ? "" : "*") + s;
  Count result;
  if (factor != 0) result.terms_[product] = factor;
  return result;
}

Count& Count::operator+=(const Count& other) {
  constant_ += other.constant_;
  unknown_ |= other.unknown_;
  for (const auto& [product, factor] : other.terms_) terms_[product] += factor;
  return *this;
}

Count operator*(const Count& count, double factor) {
  Count result;
  if (factor == 0) return result;
  result = count;
  result.constant_ *= factor;
  for (auto& [product, f] : result.terms_) f *= factor;
  return result;
}

std::optional<double> Count::value() const {
  if (unknown_ || !terms_.empty()) return std::nullopt;
  return constant_;
}

// Abbreviates products of extents that are too long to read, as those of table lookups.
static std::string readable(const std::string& product) {
  constexpr size_t longest = 200;
  return product.size() <= longest ? product : "(...)";
}

std::string Count::text() const {
  if (unknown_) return "unknown";
  if (terms_.empty()) return number_text(constant_);
  std::string out = constant_ != 0 ? number_text(constant_) : "";
  for (const auto& [product, factor] : terms_) {
    out += out.empty() ? "" : " + ";
    out += factor == 1 ? readable(product) : number_text(factor) + "*" + readable(product);
  }
  return out;
}

Count FuncOperations::operations() const {
  Count total;
  if (!stored) return total;
  for (const StageOperations& s : stages) total += s.iterations * s.each.total();
  return total;
}

Count OperationCount::sum(double Operations::*part) const {
  Count total;
  for (const FuncOperations& f : funcs) {
    if (!f.stored) continue;
    for (const StageOperations& s : f.stages) total += s.iterations * (s.each.*part);
  }
  return total;
}
Count OperationCount::moves() const { return sum(&Operations::moves); }
Count OperationCount::adds() const { return sum(&Operations::adds); }
Count OperationCount::mults() const { return sum(&Operations::mults); }
Count OperationCount::nonlinear() const { return sum(&Operations::nonlinear); }

Count OperationCount::operations() const {
  Count total;
  for (const FuncOperations& f : funcs) total += f.operations();
  return total;
}

Count OperationCount::bytes() const {
  Count total;
  for (const FuncOperations& f : funcs) total += f.bytes;
  return total;
}

const FuncOperations* OperationCount::find(const FuncContents* f) const {
  return first_where(funcs, [&](const FuncOperations& entry) { return entry.func.get() == f; });
}

OperationCount count_operations(const std::vector<WantedFunc>& outputs) {
  const FactoredGraph factored =
      with_factors(mapped(outputs, &WantedFunc::func), regions_of(outputs));
  std::vector<WantedFunc> compiled = outputs;
  for (size_t i = 0; i < outputs.size(); ++i) compiled[i].func = factored.outputs[i];
  OperationCount result = Counter(compiled).run();
  std::unordered_map<const FuncContents*, const FuncContents*> originals;
  for (const auto& [f, copy] : factored.copies) originals[copy.get()] = f;
  for (FuncOperations& entry : result.funcs) {
    const auto original = originals.find(entry.func.get());
    if (original != originals.end())
      entry.func = std::const_pointer_cast<FuncContents>(original->second->shared_from_this());
  }
  return result;
}

}  // namespace retrograde::autodiff
