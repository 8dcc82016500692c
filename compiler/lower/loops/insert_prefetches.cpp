// insert_prefetches -- prefetch the data that later iterations of a loop read.
// In:  Loops; names unique.
// Out: Loops; the same stores.
//
//   for y { out(x, y) = in(x, y) ... }
//     =>   for y { prefetch in [.., ..], [y + 2, 1]; out(x, y) = in(x, y) ... }
//     =>   for y { for line { prefetch(&in(16 line, y + 2)) }; out(x, y) = in(x, y) ... }
//
// Method: takes the box that one iteration of the loop `at` reads, with the loop variable `from` moved by the offset;
//         lets between the two loops are expanded first. The bound strategy decides about boxes beyond the data: the
//         box is clamped to the data, or prefetched only if it lies inside, or prefetched regardless, which never
//         faults.
// Not done: limiting the size; boxes larger than a cache are fetched completely.
// Source: Halide's documentation of prefetch. Tests: test/golden/pipeline/insert_prefetches/,
//         test/golden/pipeline/lower_prefetches/, test/unit/lower/prefetch_test.cpp.
#include "lower/loops/insert_prefetches.h"

#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/markers.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "lower/walk_in_bounds.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int line_bytes = 64;

// The box that the statement reads of a Func or image.
Box region_read(const Stmt& s, const std::string& name) {
  Box box;
  walk_in_bounds(
      s,
      [&](const Expr& e, const Scope<Interval>& scope) {
        const auto uses = footprints(e, scope);
        if (const auto it = uses.find(name); it != uses.end()) box = hull(box, it->second.box);
      },
      [](const Stmt&, const Scope<Interval>&) {});
  return box;
}

class Inserter : public StatementRewriter {
 public:
  explicit Inserter(const Program& program) : program_(program) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (const Realize* n = s.as<Realize>()) {
      realized_[original_name(n->name)] = n->name;
      Stmt result = children(s);
      realized_.erase(original_name(n->name));
      return result;
    }
    if (const LetStmt* n = s.as<LetStmt>()) {
      lets_.emplace_back(n->name, n->value);
      Stmt result = children(s);
      lets_.pop_back();
      return result;
    }
    const For* n = s.as<For>();
    if (!n) return children(s);
    loops_.push_back({n->name, lets_.size()});
    Stmt result =
        map_children(s, [&](const Stmt& body) { return with_prefetches(*n, (*this)(body)); });
    loops_.pop_back();
    return result;
  }

 private:
  struct OuterLoop {
    std::string name;
    size_t lets;  // number of lets around it
  };
  const Program& program_;
  Lets lets_;
  std::vector<OuterLoop> loops_;
  std::map<std::string, std::string> realized_;

  Stmt with_prefetches(const For& n, Stmt body) {
    const LoopName loop = decode_loop_name(n.name);
    const LoopedFunc* f = program_.find(loop.func);
    if (!f || loop.stage.empty()) return body;
    const auto stage = static_cast<size_t>(std::stoi(loop.stage));
    if (stage >= f->stages.size()) return body;
    const auto& directives = f->stages[stage].schedule.prefetches;
    for (auto it = directives.rbegin(); it != directives.rend(); ++it) {
      if (it->at != loop.var) continue;
      const Stmt fetch = prefetch(*it, loop, n.body);
      if (fetch.defined()) body = make_block({fetch, body});
    }
    return body;
  }

  // Undefined if the loop does not read the Func or image, or if no loop has the name `from`.
  Stmt prefetch(const PrefetchDirective& directive, const LoopName& at, const Stmt& body) {
    const auto image = std::dynamic_pointer_cast<ParameterContents>(directive.symbol.lock());
    const auto found = realized_.find(directive.name);
    const std::string name = image                      ? image->name
                             : found == realized_.end() ? directive.name
                                                        : found->second;
    Box box = region_read(body, name);
    const OuterLoop* from = find_loop(directive.from, at);
    if (box.empty() || !from) return {};
    const Substitution later = moved(*from, directive.offset);
    std::vector<Range> region, data;
    for (size_t d = 0; d < box.size(); d++) {
      if (!box[d].is_bounded()) return {};
      // Promises about this iteration's coordinates need not hold for a later iteration.
      const Expr min = simplify(without_any_promises(substitute(box[d].min, later)));
      const Expr max = simplify(without_any_promises(substitute(box[d].max, later)));
      region.push_back({min, simplify(max - min + 1)});
      data.push_back(extent_of_data(name, d));
    }
    const Type type = image ? image->type : type_of_func(directive.name);
    return bounded(directive.strategy, name, type, region, data,
                   image ? directive.symbol : SymbolRef());
  }

  Range extent_of_data(const std::string& name, size_t d) const {
    const LoopedFunc* f = program_.find(name);
    const std::string buffer = f && f->is_output ? value_buffer_name(*f->func, 0) : name;
    return metadata_range(buffer, d);
  }

  Type type_of_func(const std::string& name) const {
    const LoopedFunc* f = program_.find(name);
    return f ? f->func->types[0] : Int(32);
  }

  const OuterLoop* find_loop(const std::string& var, const LoopName& at) const {
    for (auto it = loops_.rbegin(); it != loops_.rend(); ++it) {
      const LoopName loop = decode_loop_name(it->name);
      if (loop.func == at.func && loop.stage == at.stage && loop.var == var) return &*it;
    }
    return nullptr;
  }

  // The values of the loop's variable and of every let inside of the loop, `offset` iterations later.
  Substitution moved(const OuterLoop& loop, const Expr& offset) const {
    Substitution later;
    later[loop.name] = variable(loop.name) + cast(Int(32), offset);
    for (size_t i = loop.lets; i < lets_.size(); i++)
      later[lets_[i].first] = substitute(lets_[i].second, later);
    return later;
  }

  static Stmt bounded(PrefetchBoundStrategy strategy, const std::string& name, Type type,
                      std::vector<Range> region, const std::vector<Range>& data,
                      const SymbolRef& symbol) {
    Expr inside = const_true();
    for (size_t d = 0; d < region.size(); d++) {
      Range& part = region[d];
      const Expr last = part.min + part.extent - 1, last_data = data[d].min + data[d].extent - 1;
      inside = inside && data[d].min <= part.min && last <= last_data;
      if (strategy != PrefetchBoundStrategy::Clamp) continue;
      const Expr min = clamp(part.min, data[d].min, last_data);
      part = {min, clamp(last, data[d].min, last_data) - min + 1};
    }
    const Stmt fetch = make_prefetch(name, type, region, symbol);
    return strategy == PrefetchBoundStrategy::GuardWithIf ? make_if(inside, fetch) : fetch;
  }
};

// Loops over the box that prefetch the first element of each cache line along dimension 0, and its last element.
template <class Element>
Stmt lines(const Prefetch& n, Type type, FreshNames& fresh, const Element& element) {
  const int step = std::max(1, line_bytes / type.bytes());
  std::vector<Expr> point;
  std::vector<std::pair<std::string, Range>> loops;
  for (size_t d = 0; d < n.bounds.size(); d++) {
    const Range& range = n.bounds[d];
    const std::string name = fresh(text(n.name, ".prefetch.", d));
    const Expr at = variable(name);
    if (d == 0) {
      loops.push_back({name, {0, simplify((range.extent + (step - 1)) / step + 1)}});
      point.push_back(range.min + min(at * step, max(range.extent - 1, 0)));
    } else {
      loops.push_back({name, range});
      point.push_back(at);
    }
  }
  const Expr address = call_op(Op::address_of, Handle(), {element(point)});
  Stmt body = make_evaluate(call_op(Op::prefetch, Int(32), {address}));
  for (const auto& [name, range] : loops)
    body = make_for(name, range.min, range.extent, ForType::Serial, body);
  return body;
}

Stmt lines(const Prefetch& n, const Program& program, FreshNames& fresh) {
  if (n.symbol.defined()) {
    return lines(n, n.type, fresh, [&](const std::vector<Expr>& point) {
      return call_image(n.name, n.type, point, n.symbol);
    });
  }
  const LoopedFunc* f = program.find(n.name);
  const std::vector<Type> types = f ? f->func->types : std::vector<Type>{n.type};
  std::vector<Stmt> stmts;
  for (size_t i = 0; i < types.size(); i++) {
    stmts.push_back(lines(n, types[i], fresh, [&](const std::vector<Expr>& point) {
      return call_func(n.name, types[i], point, static_cast<int>(i),
                       f ? SymbolRef(f->func) : SymbolRef());
    }));
  }
  return make_block(std::move(stmts));
}

bool any_prefetch(const Program& program) {
  for (const LoopedFunc& f : program.funcs) {
    for (const Definition& stage : f.stages) {
      if (!stage.schedule.prefetches.empty()) return true;
    }
  }
  return false;
}

}  // namespace

Stmt insert_prefetches(const Stmt& s, const Program& program) {
  return any_prefetch(program) ? Inserter(program)(s) : s;
}

Stmt lower_prefetches(const Stmt& s, const Program& program) {
  if (!any_prefetch(program)) return s;
  FreshNames fresh(s);
  return rewrite_statements(s, [&](const Stmt& part, auto& all) {
    const Prefetch* n = part.as<Prefetch>();
    return n ? lines(*n, program, fresh) : all.children(part);
  });
}

}  // namespace retrograde::lower
