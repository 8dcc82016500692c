// inject_tracing -- insert trace events for loads, stores and realizations.
// In:  Nests, as build_loop_nests gives it.
// Out: Nests; the same stores in the same order, with events between them.
//
//   realize f [a, n] {              let f.trace_id = begin_realization f [a, n] in
//     produce f { f(x) = v }          realize f [a, n] {
//     consume f { g(x) = f(x) } =>      let f.trace_id = produce f ... in
//   }                                     f(x) = trace(v, store, f, x)
//                                       end_produce f
//                                       let f.trace_id = consume f ... in
//                                         g(x) = trace(f(x), load, f, x)
//                                       ...
//
// Method: a load or a stored value is wrapped in Op::trace, which returns its first argument. An event thus happens
//         where, when and as often as the access, in vectors and branches, too. Realizations, productions and
//         consumptions are reported by calls around statements. The parent of an event is the innermost
//         enclosing event of its Func, or the beginning of the pipeline if there is none.
// Source: HalideRuntime.h on halide_trace. Tests: test/unit/lower/tracing_test.cpp.
#include "lower/instrumentation/inject_tracing.h"

#include <HalideRuntime.h>

#include <set>

#include "diagnostics/error.h"
#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/nests/root_statement.h"
#include "lower/runtime_call.h"
#include "lower/walk_in_bounds.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

const char* const pipeline_id = "pipeline.trace_id";

// The union of what target and schedule request.
TraceSchedule requested_trace(TraceSchedule trace, const Target& target) {
  trace.loads |= target.has_feature(Target::TraceLoads);
  trace.stores |= target.has_feature(Target::TraceStores);
  trace.realizations |= target.has_feature(Target::TraceRealizations);
  return trace;
}
bool is_any(const TraceSchedule& trace) {
  return trace.loads || trace.stores || trace.realizations;
}

// Appends the number of values and then min and extent of each dimension.
void add_region(const std::vector<Range>& region, std::vector<Expr>& args) {
  std::vector<Expr> numbers;
  for (const Range& range : region) {
    numbers.push_back(cast(Int(32), range.min));
    numbers.push_back(cast(Int(32), range.extent));
  }
  args.push_back(numbers.empty() ? null_handle() : pack(numbers));
  args.push_back(Expr(static_cast<int32_t>(numbers.size())));
}

Expr region_event(const std::string& func, int event, const Expr& parent,
                  const std::vector<Range>& region, const Expr& tag = null_handle()) {
  std::vector<Expr> args = {Expr(func), Expr(event), parent};
  add_region(region, args);
  args.push_back(tag);
  return call_runtime("retrograde_trace_region", std::move(args));
}

// The box of all points of a Func to which a statement stores.
Box region_stored(const Stmt& s, const std::string& func) {
  Box box;
  walk_in_bounds(
      s, [](const Expr&, const Scope<Interval>&) {},
      [&](const Stmt& part, const Scope<Interval>& scope) {
        const auto* n = part.as<Provide>();
        if (!n || n->name != func) return;
        const Box point = mapped(n->args, [&](const Expr& arg) { return bounds_of(arg, scope); });
        box = hull(box, point);
      });
  return box;
}

class Tracer : public Rewriter {
 public:
  Tracer(const Program& program, const Target& target) : target_(target) {
    for (const LoopedFunc& f : program.funcs) {
      const TraceSchedule trace = requested_trace(f.func->trace, target);
      if (is_any(trace)) traces_[f.name()] = trace;
    }
  }
  std::set<std::string> traced;  // names for which events were inserted

  Stmt realization(const std::string& func, const std::vector<Range>& region, const Stmt& body) {
    return with_events(func, halide_trace_begin_realization, halide_trace_end_realization, region,
                       body);
  }
  bool traces_realizations(const std::string& func) const {
    const auto it = traces_.find(func);
    return it != traces_.end() && it->second.realizations;
  }
  bool traces(const std::string& func) const { return traces_.count(func) > 0; }

 protected:
  Expr rewrite(const Expr& e) override {
    if (as_op(e, Op::address_of)) return e;
    const Expr result = children(e);
    const Call* call = result.as<Call>();
    if (!call) return result;
    const bool is_access =
        (call->call_type == CallType::Func && loads_of(call->name)) || is_traced_image(*call);
    if (!is_access) return result;
    return event(result, halide_trace_load, call->name, call->component, call->args);
  }

  Stmt rewrite(const Stmt& s) override {
    if (const Provide* n = s.as<Provide>()) return store(s, *n);
    if (const Realize* n = s.as<Realize>(); n && traces_realizations(n->name)) return realize(*n);
    if (const ProducerConsumer* n = s.as<ProducerConsumer>(); n && traces_realizations(n->name))
      return produce_or_consume(*n);
    return children(s);
  }

 private:
  const Target& target_;
  std::map<std::string, TraceSchedule> traces_;
  std::map<std::string, std::vector<Range>> produced_;  // the latest region of each Func
  std::set<std::string> with_id_;                       // Funcs with an enclosing event

  bool loads_of(const std::string& func) const {
    const auto it = traces_.find(func);
    return it != traces_.end() && it->second.loads;
  }

  bool is_traced_image(const Call& call) const {
    if (call.call_type != CallType::Image) return false;
    const auto param = std::dynamic_pointer_cast<ParameterContents>(call.symbol.lock());
    return requested_trace(param ? param->trace : TraceSchedule(), target_).loads;
  }

  std::string id_of(const std::string& func) const {
    return with_id_.count(func) ? func + ".trace_id" : pipeline_id;
  }

  Expr event(const Expr& value, int code, const std::string& func, int component,
             const std::vector<Expr>& coordinates) {
    traced.insert(func);
    std::vector<Expr> args = {value, Expr(code), Expr(func), Expr(component),
                              variable(id_of(func))};
    for (const Expr& coordinate : coordinates) args.push_back(cast(Int(32), coordinate));
    return call_op(Op::trace, value.type(), std::move(args));
  }

  // All values of a Tuple are computed, and their loads reported, before the first store.
  Stmt store(const Stmt& s, const Provide& n) {
    const auto it = traces_.find(n.name);
    if (it == traces_.end() || !it->second.stores) return children(s);
    std::vector<Expr> values, args;
    for (const Expr& arg : n.args) args.push_back((*this)(arg));
    Lets lets;
    for (size_t i = 0; i < n.values.size(); i++) {
      Expr value = (*this)(n.values[i]);
      if (is_undef(value)) {
        values.push_back(value);
        continue;
      }
      if (n.values.size() > 1) {
        lets.emplace_back(text(n.name, ".traced.", i), value);
        value = variable(lets.back().first, value.type());
      }
      values.push_back(event(value, halide_trace_store, n.name, static_cast<int>(i), args));
    }
    return make_lets(lets, make_provide(n.name, values, args, (*this)(n.predicate)));
  }

  // begin; body; end. The number of the first event is the parent of the events inside.
  Stmt with_events(const std::string& func, int begin, int end, const std::vector<Range>& region,
                   const Stmt& body) {
    traced.insert(func);
    const std::string id = func + ".trace_id";
    return make_let(
        id, region_event(func, begin, variable(id_of(func)), region),
        make_block({body, make_evaluate(region_event(func, end, variable(id), region))}));
  }

  Stmt realize(const Realize& n) {
    std::vector<Range> region;
    for (const Range& range : n.bounds)
      region.push_back({(*this)(range.min), (*this)(range.extent)});
    const Stmt inside = within(n.name, [&] { return (*this)(n.body); });
    return with_body(n, realization(n.name, region, inside));
  }

  Stmt produce_or_consume(const ProducerConsumer& n) {
    if (n.produces) produced_[n.name] = region_of(n);
    const std::vector<Range> region = produced_[n.name];
    const bool had_id = with_id_.count(n.name) > 0;
    const Stmt body = within(n.name, [&] { return (*this)(n.body); });
    RETROGRADE_ASSERT(had_id, "a region of ", n.name, " outside of its realization");
    return make_producer_consumer(
        n.name, n.produces,
        with_events(n.name, n.produces ? halide_trace_produce : halide_trace_consume,
                    n.produces ? halide_trace_end_produce : halide_trace_end_consume, region,
                    body));
  }

  std::vector<Range> region_of(const ProducerConsumer& n) {
    return mapped(region_stored(n.body, n.name), [&](const Interval& side) {
      const bool known = side.is_bounded();
      return Range{known ? simplify(side.min) : Expr(0),
                   known ? simplify(side.max - side.min + 1) : Expr(0)};
    });
  }

  template <class Make>
  Stmt within(const std::string& func, Make&& make) {
    const bool is_new = with_id_.insert(func).second;
    forget();
    Stmt result = make();
    if (is_new) with_id_.erase(func);
    forget();
    return result;
  }

 public:
  // The same around the whole body, for an output.
  template <class Make>
  Stmt output(const std::string& func, const std::vector<Range>& region, Make&& make) {
    const Stmt inside = within(func, make);
    return realization(func, region, inside);
  }
};

std::vector<Range> buffer_region(const LoopedFunc& f) {
  std::vector<Range> region;
  const std::string buffer = value_buffer_name(*f.func, 0);
  for (int d = 0; d < f.func->dimensions(); d++) region.push_back(metadata_range(buffer, d));
  return region;
}

// A tag that tells readers of a trace the types and dimensions of a Func in advance.
Stmt type_tag(const LoopedFunc& f, const Box& box) {
  std::string text = "func_type_and_dim: " + std::to_string(f.func->types.size());
  for (const Type& type : f.func->types) {
    const int code = type.code() == TypeCode::BFloat ? 4 : static_cast<int>(type.code());
    text += " " + std::to_string(code) + " " + std::to_string(type.bits()) + " 1";
  }
  text += " " + std::to_string(f.func->dimensions());
  std::vector<Range> region;
  for (const Interval& side : box) {
    if (side.is_bounded()) region.push_back({side.min, side.max - side.min + 1});
  }
  std::vector<Expr> args = {Expr(f.name()), variable(pipeline_id), Expr(text)};
  add_region(region, args);
  return make_evaluate(call_runtime("retrograde_trace_type", std::move(args)));
}

// The regions of all Funcs at root, if they are known there.
std::map<std::string, Box> regions_at_root(const Stmt& s) {
  std::map<std::string, Box> regions;
  walk_in_bounds(
      s, [](const Expr&, const Scope<Interval>&) {},
      [&](const Stmt& part, const Scope<Interval>& scope) {
        const auto* n = part.as<Realize>();
        if (!n) return;
        Box box;
        for (const Range& range : n->bounds) {
          Interval side{bounds_of(range.min, scope).min,
                        bounds_of(range.min + range.extent - 1, scope).max};
          if (side.is_bounded()) side = {simplify(side.min), simplify(side.max)};
          box.push_back(side);
        }
        regions[n->name] = hull(regions[n->name], box);
      });
  return regions;
}

}  // namespace

Stmt inject_tracing(const Stmt& s, const Program& program, const std::string& pipeline,
                    const Target& target) {
  RootStatement root = split_root(s);
  Tracer tracer(program, target);
  std::function<Stmt()> body = [&] { return tracer(root.loops); };
  for (auto it = program.funcs.begin(); it != program.funcs.end(); ++it) {
    if (!it->is_output || !tracer.traces_realizations(it->name())) continue;
    body = [&tracer, f = &*it, inner = body] {
      return tracer.output(f->name(), buffer_region(*f), inner);
    };
  }
  const Stmt traced = body();
  if (tracer.traced.empty() && !target.has_feature(Target::TracePipeline)) return s;
  const std::map<std::string, Box> regions = regions_at_root(root.loops);
  std::vector<Stmt> types, tags;
  for (const LoopedFunc& f : program.funcs) {
    if (!tracer.traces(f.name())) continue;
    const Box box = f.is_output ? buffer_box(value_buffer_name(*f.func, 0), f.func->dimensions())
                                : value_or(regions, f.name(), {});
    types.push_back(type_tag(f, box));
    for (const std::string& tag : f.func->trace.tags)
      tags.push_back(make_evaluate(
          region_event(f.name(), halide_trace_tag, variable(pipeline_id), {}, Expr(tag))));
  }
  std::vector<Stmt> all = types;
  all.insert(all.end(), tags.begin(), tags.end());
  all.push_back(traced);
  all.push_back(
      make_evaluate(region_event(pipeline, halide_trace_end_pipeline, variable(pipeline_id), {})));
  root.loops =
      make_let(pipeline_id, region_event(pipeline, halide_trace_begin_pipeline, Expr(0), {}),
               make_block(std::move(all)));
  return joined(root);
}

}  // namespace retrograde::lower
