// memoize -- look up the results of memoized Funcs in a cache before computing them.
// In:  Loops; names unique.
// Out: Loops.
//
//   realize f [min, extent] {         realize f [min, extent] {
//     produce f { P }                   let key = pack("pipeline", "f", target, k, min, max ...)
//     consume f { C }           =>      let missing = lookup(key, &f(min), 4 extent)
//   }                                   if (missing) { produce f { P }  store(key, ...) }
//                                       consume f { C }
//                                     }
//
// Method: the key names the compiled function and the Func. It holds the values of the Params that the Func depends on
//         (found through all Funcs that it calls), the keys of memoize_tag instead of the tagged expressions, and the
//         region that is read. The cache keeps the complete storage.
// Errors: a memoized Func that reads an ImageParam without memoize_tag; one that is stored outside of its compute
//         level; a tag or eviction key that depends on Vars.
// Source: Halide's documentation of memoize and memoize_tag. Tests: test/golden/pipeline/memoize/,
//         test/unit/lower/memoize_test.cpp.
#include "lower/loops/memoize.h"

#include <algorithm>
#include <unordered_set>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/runtime_call.h"

namespace retrograde::lower {

namespace {

bool is_memoized(const LoopedFunc* f) { return f && f->schedule.memoized; }

constexpr const char* key_mark = ".key.";

std::string key_name(const std::string& func, const char* side, size_t dimension) {
  return text(func, key_mark, side, dimension);
}

// ---- the key ----

class Dependencies {
 public:
  explicit Dependencies(const LoopedFunc& f) : f_(f) { visit(*f.func); }
  std::vector<Expr> parts;  // scalar Params and tags, in first-use order

 private:
  void visit(const FuncContents& f) {
    if (!funcs_.insert(&f).second) return;
    for_each_expr(f, [&](const Expr& e) { visit(e); });
    if (!f.extern_definition) return;
    for (const ExternArgument& arg : f.extern_definition->args) {
      if (arg.func) visit(*arg.func);
      if (arg.expr.defined()) visit(arg.expr);
      if (arg.buffer) check_image(*arg.buffer);
    }
  }

  void visit(const Expr& e) {
    walk(e, [&](const Expr& node) {
      const Call* call = node.as<Call>();
      if (call && call->is_op(Op::memoize_tag)) {
        for (size_t i = 1; i < call->args.size(); i++) add_tag(call->args[i]);
        return false;
      }
      if (call && call->call_type == CallType::Func) visit(*func_of(*call));
      if (call && call->call_type == CallType::Image) visit_image(*call);
      if (const Variable* variable = node.as<Variable>()) visit_variable(node, *variable);
      return true;
    });
  }

  void visit_image(const Call& call) {
    const auto param = std::dynamic_pointer_cast<ParameterContents>(call.symbol.lock());
    if (param) check_image(*param);
  }

  void check_image(const ParameterContents& param) const {
    if (param.is_literal) return;
    user_error(text("memoize ", quoted(f_.name())),
               "what an image holds is no part of a memoized Func's key",
               text(quoted(f_.name()), " depends on the ImageParam ", quoted(param.name)),
               "Wrap what is read in memoize_tag(value, key...), with keys that change whenever "
               "the image does");
  }

  void visit_variable(const Expr& e, const Variable& variable) {
    const auto param = std::dynamic_pointer_cast<ParameterContents>(variable.symbol.lock());
    if (!param || !names_.insert(variable.name).second) return;
    parts.push_back(e);
  }

  void add_tag(const Expr& tag) {
    check_is_constant(f_, tag, "the key of memoize_tag");
    parts.push_back(tag);
  }

 public:
  static void check_is_constant(const LoopedFunc& f, const Expr& e, const char* what) {
    walk(e, [&](const Expr& node) {
      const Variable* variable = node.as<Variable>();
      const Call* call = node.as<Call>();
      const bool is_param =
          variable && std::dynamic_pointer_cast<ParameterContents>(variable->symbol.lock());
      const bool reads = call && call->call_type != CallType::Operator;
      if ((!variable || is_param) && !reads) return true;
      user_error(text("memoize ", quoted(f.name())),
                 text(what, " must be made of Params and constants"),
                 text("it mentions ", quoted(variable ? variable->name : call->name)),
                 "Use values that are the same for the whole call");
      return false;
    });
  }

 private:
  const LoopedFunc& f_;
  std::unordered_set<const FuncContents*> funcs_;
  std::unordered_set<std::string> names_;
};

std::vector<Expr> bytes_of(const std::string& text) {
  std::vector<Expr> bytes = {Expr(static_cast<int32_t>(text.size()))};
  for (char c : text) bytes.push_back(Expr(static_cast<uint8_t>(c)));
  return bytes;
}

void check_schedule(const LoopedFunc& f) {
  if (f.is_output) {
    user_error(text("memoize ", quoted(f.name())), "an output is computed by every call",
               "it is an output of the pipeline", "Memoize a Func that the output reads");
  }
  if (is_stored_where_computed(f)) return;
  user_error(text("memoize ", quoted(f.name())),
             "a memoized Func must be computed whole, where its storage begins",
             "its storage level lies outside of its compute level",
             "Leave store_at and store_root out");
}

// The lets that with_key_region inserts.
class KeyRegions {
 public:
  void note(const std::string& let) {
    if (let.find(key_mark) != std::string::npos) lets_[let.substr(0, let.find(".$"))] = let;
  }
  Expr of(const LoopedFunc& f, const char* side, size_t dimension) const {
    const auto it = lets_.find(key_name(f.name(), side, dimension));
    RETROGRADE_ASSERT(it != lets_.end(), "no key of ", f.name());
    return variable(it->second);
  }

 private:
  std::map<std::string, std::string> lets_;  // the innermost let, by its name before renaming
};

class Memoizer : public Rewriter {
 public:
  Memoizer(const Program& program, const std::string& function, const Target& target)
      : program_(program), function_(function), target_(target) {}

 protected:
  Expr rewrite(const Expr& e) override {
    const Call* tag = as_op(e, Op::memoize_tag);
    return tag ? (*this)(tag->args[0]) : children(e);
  }

  Stmt rewrite(const Stmt& s) override {
    if (const Realize* n = s.as<Realize>()) storage_[n->name] = n;
    if (const LetStmt* n = s.as<LetStmt>()) regions_.note(n->name);
    const ProducerConsumer* n = s.as<ProducerConsumer>();
    const LoopedFunc* f = n && n->produces ? program_.find(n->name) : nullptr;
    if (!is_memoized(f)) return children(s);
    check_schedule(*f);
    return lookup(*f, n->name, children(s));
  }

 private:
  std::vector<Expr> key_of(const LoopedFunc& f) {
    std::vector<Expr> key = bytes_of(function_ + "\n" + f.name() + "\n" + target_.to_string());
    for (const Expr& part : Dependencies(f).parts) key.push_back(part);
    for (size_t d = 0; d < f.func->args.size(); d++) {
      key.push_back(regions_.of(f, "min.", d));
      key.push_back(regions_.of(f, "max.", d));
    }
    return key;
  }

  Stmt lookup(const LoopedFunc& f, const std::string& name, const Stmt& produce) {
    const auto found = storage_.find(name);
    RETROGRADE_ASSERT(found != storage_.end(), "no storage of ", name);
    const std::vector<Range>& bounds = found->second->bounds;
    std::vector<Expr> folds = found->second->layout.folds;
    folds.resize(bounds.size());
    std::vector<Expr> first;
    Expr elements = make_const(Int(64), 1);
    for (size_t d = 0; d < bounds.size(); d++) {
      const Expr& fold = folds[d];  // folded storage starts at coordinate 0
      first.push_back(fold.defined() ? Expr(0) : bounds[d].min);
      const Expr extent = fold.defined() ? fold : max(bounds[d].extent, Expr(0));
      elements = elements * cast(Int(64), extent);
    }
    std::vector<Expr> blocks, sizes;
    for (size_t i = 0; i < f.func->types.size(); i++) {
      const Type type = f.func->types[i];
      blocks.push_back(call_op(Op::address_of, Handle(),
                               {call_func(name, type, first, static_cast<int>(i), {})}));
      sizes.push_back(elements * make_const(Int(64), type.bytes()));
    }
    const Expr key = pack(key_of(f));
    const std::string prefix = name + ".memoization";
    const std::vector<Expr> what = {variable(prefix + "_key", Handle()), Expr(key_bytes(key)),
                                    Expr(static_cast<int32_t>(blocks.size())),
                                    variable(prefix + "_blocks", Handle()),
                                    variable(prefix + "_bytes", Handle())};
    Stmt body = make_if(variable(prefix + "_missing") != 0, make_block({produce, store(f, what)}));
    body = make_let(prefix + "_missing", call_runtime("retrograde_memoization_lookup", what), body);
    body = make_let(prefix + "_bytes", pack(sizes), body);
    body = make_let(prefix + "_blocks", pack(blocks), body);
    return make_let(prefix + "_key", key, body);
  }

  static Stmt store(const LoopedFunc& f, std::vector<Expr> what) {
    const Expr& key = f.schedule.eviction_key;
    if (key.defined()) Dependencies::check_is_constant(f, key, "the eviction key");
    what.push_back(Expr(key.defined() ? 1 : 0));
    what.push_back(key.defined() ? eviction_bits(key) : make_uint_const(UInt(64), 0));
    return make_evaluate(call_runtime("retrograde_memoization_store", what));
  }

  // The key as 64 bits, the form in which the runtime's eviction takes it: for pointers and numbers of any width.
  static Expr eviction_bits(const Expr& key) {
    if (key.type().is_handle()) return reinterpret_as(UInt(64), key);
    return cast(UInt(64), key);
  }

  static int32_t key_bytes(const Expr& pack) {
    int32_t bytes = 0;
    for (const Expr& part : pack.as<Call>()->args) bytes += part.type().bytes();
    return bytes;
  }

  const Program& program_;
  const std::string& function_;
  const Target& target_;
  std::map<std::string, const Realize*> storage_;
  KeyRegions regions_;
};

}  // namespace

Stmt with_key_region(const std::string& func, const Box& read, Stmt storage) {
  for (size_t d = read.size(); d-- > 0;) {
    storage = make_let(key_name(func, "max.", d), read[d].max, storage);
    storage = make_let(key_name(func, "min.", d), read[d].min, storage);
  }
  return storage;
}

Stmt memoize(const Stmt& s, const Program& program, const std::string& function,
             const Target& target) {
  const bool any = std::any_of(program.funcs.begin(), program.funcs.end(),
                               [](const LoopedFunc& f) { return is_memoized(&f); });
  return any ? Memoizer(program, function, target)(s) : s;
}

}  // namespace retrograde::lower
