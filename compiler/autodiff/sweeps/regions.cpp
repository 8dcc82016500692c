#include "autodiff/sweeps/regions.h"

#include <algorithm>

#include "autodiff/sweeps/custom_rules.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// The loops of a definition: pure variables, then reduction variables.
std::vector<LoopVariable> loops_of(const FuncContents& f, const Definition& definition,
                                   const Box& box) {
  std::vector<LoopVariable> loops;
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (is_pure_position(f, definition, d))
      loops.push_back({f.args[d], box.at(d).min, box.at(d).max, false});
  }
  for (const ReductionVariable& r : definition.rvars)
    loops.push_back({r.var, r.min, simplify(r.min + r.extent - 1), true});
  return loops;
}

// An update over an empty domain: the range of what it reads of its own Func says nothing.
bool never_runs(const Definition& definition) {
  return std::ranges::any_of(definition.rvars, [](const ReductionVariable& r) {
    return as_const_int(simplify(r.extent)).value_or(1) <= 0;
  });
}

// Takes the bounds from `other` where `box` has none: for a data-dependent index only the region that others read is
// known.
Box or_else(const Box& box, const Box& other) {
  Box result = box;
  for (size_t d = 0; d < box.size(); ++d) {
    if (!result[d].min.defined()) result[d].min = other[d].min;
    if (!result[d].max.defined()) result[d].max = other[d].max;
  }
  return result;
}

}  // namespace

Regions::Regions(const std::vector<FuncPtr>& order, const Box& output) {
  if (order.empty()) return;
  boxes_[order.back().get()] = output;
  outputs_.insert(order.back().get());
  for (auto f = order.rbegin(); f != order.rend(); ++f) add_func(*f);
}

Regions::Regions(const std::vector<FuncPtr>& order, const std::map<const Symbol*, Box>& outputs)
    : boxes_(outputs.begin(), outputs.end()) {
  for (const auto& [symbol, box] : outputs) outputs_.insert(symbol);
  for (auto f = order.rbegin(); f != order.rend(); ++f) add_func(*f);
}

void Regions::add(const FuncPtr& f, const Box& box) {
  grow(f.get(), box);
  add_func(f);
}

void Regions::grow(const Symbol* symbol, const Box& box) {
  Box& mine = boxes_[symbol];
  mine = hull(mine, box);
  for (Interval& i : mine) {
    if (i.min.defined()) i.min = simplify(i.min);
    if (i.max.defined()) i.max = simplify(i.max);
  }
}

void Regions::add_func(const FuncPtr& f) {
  auto found = boxes_.find(f.get());
  if (found == boxes_.end() || (found->second.empty() && !f->args.empty())) return;  // never read
  // The region of an output is fixed: it has no elements beyond.
  const bool is_output = outputs_.contains(f.get());
  std::map<const Symbol*, Box> callees;
  // From the last stage to the first, because earlier stages must hold the elements of the Func that an update reads.
  for (int s = f->stage_count() - 1; s >= 0; --s) {
    const Definition& definition = f->stage(s);
    Scope<Interval> scope = scope_of(loops_of(*f, definition, boxes_[f.get()]));
    const Box written = numbered(f->args.size(), [&](size_t d) {
      const Interval mine = boxes_[f.get()][d];
      return is_pure_position(*f, definition, d) ? mine : bounds_of(definition.args[d], scope);
    });
    const bool grows = !never_runs(definition);
    if (s > 0 && grows) grow(f.get(), or_else(written, boxes_[f.get()]));
    const bool has_known_reads = is_output || !read_elsewhere(*f, definition).defined();
    for_each_expr(definition, [&](const Expr& e) {
      for (const auto& [name, footprint] : footprints(without_lets(e), scope)) {
        Symbol* symbol = footprint.symbol.raw();
        if (symbol != f.get())
          callees[symbol] = hull(callees[symbol], footprint.box);
        else if (grows)
          grow(f.get(), has_known_reads ? or_else(footprint.box, boxes_[f.get()]) : footprint.box);
      }
    });
  }
  for (const auto& [symbol, box] : callees) grow(symbol, box);
  add_extern_arguments(*f);
}

// Adds the arguments of a C function, whose reads the definitions do not show.
void Regions::add_extern_arguments(const FuncContents& f) {
  if (!f.is_extern()) return;
  for (const ExternArgument& a : f.extern_definition->args) {
    if (a.func) grow(a.func.get(), extern_reads(f, a.func, a.func->dimensions(), of(&f)));
    if (a.buffer) grow(a.buffer.get(), extern_reads(f, a.buffer, a.buffer->dimensions, of(&f)));
  }
}

const Box& Regions::of(const Symbol* symbol) const {
  static const Box nothing;
  const Box* found = find_or_null(boxes_, symbol);
  return found ? *found : nothing;
}

std::vector<LoopVariable> Regions::loop_variables(const Symbol* symbol,
                                                  const std::vector<std::string>& names) const {
  const Box& box = of(symbol);
  return numbered(std::min(names.size(), box.size()), [&](size_t d) {
    return LoopVariable{names[d], box[d].min, box[d].max};
  });
}

IterationDomain Regions::domain(const FuncContents& f, int stage) const {
  const Definition& definition = f.stage(stage);
  IterationDomain result{loops_of(f, definition, of(&f)), {}};
  if (definition.predicate.defined()) result.predicate = without_lets(definition.predicate);
  return result;
}

Box box_of(const Region& region) {
  return mapped(region, [&](const Range& r) {
    Expr min = cast_to(Int(32), r.min);
    return Interval{min, simplify(min + cast_to(Int(32), r.extent) - 1)};
  });
}

}  // namespace retrograde::autodiff
