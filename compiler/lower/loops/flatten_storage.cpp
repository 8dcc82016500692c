// flatten_storage -- replace accesses of Funcs and images by accesses of flat allocations and buffers.
// In:  Loops; names unique.
// Out: FlatStorage; the same stores in the same order, except that all values of a Tuple are computed before the first
//      of them is stored. In f(x) = f(x) op operand that goes for the operand: no other store changes the element.
//
//   realize f(float32) auto [a, n], [b, m] {       let f.min.0 = a
//     f(x, y) = f(x - 1, y) + in(x, y)       =>    let f.min.1 = b
//   }                                              let f.stride.1 = n
//                                                  allocate f[int64(n) * int64(m)]:float32 auto {
//                                                    f[x - f.min.0 + (y - f.min.1)*f.stride.1] = ..
//                                                  }
//
// Method: one rewriting walk; each Realize puts its strides in scope. Constant minima and strides are substituted at
//         once, so that indices of Funcs with constant bounds do not mention them. A folded dimension has the minimum
//         0, is indexed modulo its factor and has the factor as its extent.
// Source: folklore. Tests: test/golden/lower/flatten_storage/.
#include "lower/loops/flatten_storage.h"

#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "diagnostics/error.h"
#include "graph/definitions/own_reads.h"
#include "graph/function.h"
#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"
#include "lower/definitions/resolve_undef.h"
#include "lower/nests/copy_statement.h"

namespace retrograde::lower {

namespace {

std::string element_name(const std::string& func, size_t value_count, size_t component) {
  return value_count == 1 ? func : func + "." + std::to_string(component);
}

// The layout of a buffer: one Expr per dimension.
struct Layout {
  std::vector<Expr> mins, strides, folds;
  Expr first;  // its first element in a ring buffer; undefined: 0
};

// Facts about names in the whole statement, found before any rewriting.
struct Usage {
  std::unordered_map<std::string, size_t> value_counts;  // of Funcs that are provided or realized
  std::unordered_set<std::string> variables;             // mentioned anywhere
};

Usage find_usage(const Stmt& s) {
  Usage usage;
  walk(
      s, [&](const Variable& n) { usage.variables.insert(n.name); },
      [&](const Call& n) {  // an output filled by a C function has no Provide
        if (n.call_type != CallType::Func || !n.symbol.defined()) return;
        const auto f = std::dynamic_pointer_cast<FuncContents>(n.symbol.lock());
        if (f && f->is_extern()) usage.value_counts.emplace(n.name, f->types.size());
      },
      [&](const Provide& n) { usage.value_counts[n.name] = n.values.size(); },
      [&](const Realize& n) { usage.value_counts[n.name] = n.types.size(); });
  return usage;
}

class Flattener : public Rewriter {
 public:
  explicit Flattener(const Stmt& s) : usage_(find_usage(s)), fresh_(s) {}

 protected:
  Expr rewrite(const Expr& e) override {
    const Call* call = e.as<Call>();
    if (!call || (call->call_type != CallType::Func && call->call_type != CallType::Image))
      return children(e);
    bool is_func = call->call_type == CallType::Func;
    std::string buffer = is_func ? element_of(call->name, call->component) : call->name;
    Expr index = index_of(is_func ? call->name : "", buffer, mapped(call->args, *this));
    return make_load(call->type, buffer, index, {}, is_func ? SymbolRef() : call->symbol);
  }

  Stmt rewrite(const Stmt& s) override {
    if (const Realize* n = s.as<Realize>()) return allocate(*n);
    if (const Provide* n = s.as<Provide>()) return store(*n);
    return children(s);
  }

 private:
  std::string element_of(const std::string& func, int component) const {
    return element_name(value_or(memory_of_, func, func), value_or(usage_.value_counts, func, 1),
                        component);
  }

  // `func` is empty for images.
  Expr index_of(const std::string& func, const std::string& buffer, const std::vector<Expr>& args) {
    auto realized = layouts_.find(func);
    const Expr first = realized == layouts_.end() ? Expr() : realized->second.first;
    Expr index = first.defined() ? first : Expr(0);
    for (size_t d = 0; d < args.size(); ++d) {
      bool known = realized != layouts_.end();
      Expr min = known ? realized->second.mins[d] : metadata(buffer, Metadata::Min, d);
      Expr stride = known ? realized->second.strides[d] : metadata(buffer, Metadata::Stride, d);
      Expr offset = binary(Kind::Sub, cast_to(Int(32), args[d]), min);
      if (known && realized->second.folds[d].defined())
        offset = binary(Kind::Mod, offset, realized->second.folds[d]);
      index = binary(Kind::Add, index, binary(Kind::Mul, offset, stride));
    }
    return index;
  }

  // ---- Realize ----

  static std::vector<int> storage_order(const Realize& n) {
    if (!n.layout.order.empty()) return n.layout.order;
    std::vector<int> order(n.bounds.size());
    std::iota(order.begin(), order.end(), 0);
    return order;
  }

  // Binds the value to the name, unless it is a constant that nothing refers to by name.
  Expr bind(const std::string& name, const Expr& value, Lets& bindings) const {
    if (!is_const(value) || usage_.variables.count(name)) bindings.emplace_back(name, value);
    return is_const(value) ? value : variable(name);
  }

  // The number of elements along a dimension. A negative extent, from a predicate that is never true, counts as 0.
  static Expr count_of(const Expr& extent) {
    const auto constant = as_const_int(extent);
    if (!constant) return binary(Kind::Max, extent, Expr(0));
    return *constant < 0 ? Expr(0) : extent;
  }

  Stmt allocate(const Realize& n) {
    Lets bindings;
    Layout layout;
    const size_t dimensions = n.bounds.size();
    if (n.layout.first.defined())
      layout.first = bind(n.name + ".first", (*this)(n.layout.first), bindings);
    layout.strides.resize(dimensions);
    std::vector<Expr> extents;
    layout.folds = n.layout.folds;
    layout.folds.resize(dimensions);
    for (size_t d = 0; d < dimensions; ++d) {
      const Expr& fold = layout.folds[d];
      Expr min = fold.defined() ? Expr(0) : (*this)(n.bounds[d].min);
      layout.mins.push_back(bind(metadata_name(n.name, Metadata::Min, d), min, bindings));
      Expr extent = fold.defined() ? fold : (*this)(n.bounds[d].extent);
      const std::string name = metadata_name(n.name, Metadata::Extent, d);
      extents.push_back(usage_.variables.count(name) ? bind(name, extent, bindings) : extent);
    }
    Expr stride = Expr(1), elements = make_const(Int(64), 1);
    for (int d : storage_order(n)) {
      layout.strides[d] = stride =
          bind(metadata_name(n.name, Metadata::Stride, d), stride, bindings);
      stride = binary(Kind::Mul, stride, extents[d]);
      elements = binary(Kind::Mul, elements, cast_to(Int(64), count_of(extents[d])));
    }
    layouts_[n.name] = std::move(layout);
    const bool has_memory = n.layout.place.empty();
    if (!has_memory) memory_of_[n.name] = n.layout.place;
    Stmt body = (*this)(n.body);
    for (size_t i = n.types.size(); has_memory && i-- > 0;) {
      body = make_allocate(element_name(n.name, n.types.size(), i), n.types[i], n.memory, elements,
                           body);
    }
    return make_lets(bindings, body);
  }

  // ---- Provide ----

  Stmt store(const Provide& n) {
    std::vector<Expr> values = mapped(n.values, *this), args = mapped(n.args, *this);
    Expr predicate = (*this)(n.predicate);
    Lets bindings;
    if (values.size() > 1) bind_operands(n, values, args, predicate, bindings);
    std::vector<Stmt> stores;
    for (size_t i = 0; i < values.size(); ++i) {
      if (is_undef(values[i])) continue;
      std::string buffer = element_of(n.name, static_cast<int>(i));
      stores.push_back(make_store(buffer, values[i], index_of(n.name, buffer, args), predicate));
    }
    const Stmt result = make_lets(bindings, make_block(std::move(stores)));
    return result.defined() ? result : make_evaluate(Expr(0));
  }

  // Values of a Tuple are stored one after the other, so operands that read storage are bound before the first store.
  void bind_operands(const Provide& n, std::vector<Expr>& values, std::vector<Expr>& args,
                     Expr& predicate, Lets& bindings) {
    auto bind_if_loading = [&](Expr& e, const std::string& part) {
      if (!e.defined() || !reads_memory(e, MemoryReads::Loads)) return;
      std::string name = fresh_(n.name + "." + part);
      bindings.emplace_back(name, e);
      e = variable(name, e.type());
    };
    std::vector<Expr> operands(
        values.size());  // of updates of the element; undefined: no such update
    for (size_t i = 0; i < values.size(); ++i) {
      if (is_undef(values[i])) continue;
      const Binary* update = as_update(n, i);
      if (update) operands[i] = (*this)(update->b);
      bind_if_loading(update ? operands[i] : values[i], "value." + std::to_string(i));
    }
    for (size_t d = 0; d < args.size(); ++d) bind_if_loading(args[d], "arg." + std::to_string(d));
    bind_if_loading(predicate, "predicate");
    for (size_t i = 0; i < values.size(); ++i) {
      if (!operands[i].defined()) continue;
      const std::string buffer = element_of(n.name, static_cast<int>(i));
      const Expr old = make_load(values[i].type(), buffer, index_of(n.name, buffer, args));
      values[i] = binary(n.values[i].kind(), old, operands[i]);
    }
  }

  // Value i of a Tuple if it is f(x) op operand, for the element that it is stored to; else null. Such an update stays
  // recognisable, so that its loop can become vectors.
  static const Binary* as_update(const Provide& n, size_t i) {
    const Kind kind = n.values[i].kind();
    if (kind != Kind::Add && kind != Kind::Mul && kind != Kind::Min && kind != Kind::Max)
      return nullptr;
    const auto* update = n.values[i].as<Binary>();
    const auto* own = update->a.as<Call>();
    const bool is_own = own && own->call_type == CallType::Func && own->name == n.name &&
                        own->component == static_cast<int>(i) && same_args(own->args, n.args);
    return is_own ? update : nullptr;
  }

  const Usage usage_;
  FreshNames fresh_;
  std::unordered_map<std::string, Layout> layouts_;
  std::unordered_map<std::string, std::string>
      memory_of_;  // by Func: the hoisted storage that it lies in
};

}  // namespace

Stmt flatten_storage(const Stmt& s) { return Flattener(s)(s); }

}  // namespace retrograde::lower
