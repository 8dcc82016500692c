// memoize -- look the results of memoized Funcs up before they are computed.
// In:  Loops (keys), then FlatStorage with the same names (lookups).
// Out: the same phases.
//
//   allocate f[n] {                   allocate f[n] {
//     produce f { P }                   let key = pack("pipeline", "f", target, k, min, extent ...)
//     consume f { C }           =>      let missing = lookup(key, &f[0], 4 n)
//   }                                   if (missing) { produce f { P }  store(key, &f[0], 4 n) }
//                                       consume f { C }
//                                     }
//
// Method: the key names the compiled function, the Func, and holds the values of the Params that it
//         depends on (found through all Funcs that it calls), what memoize_tag puts in place of an
//         expression, and the region that is computed. The region stands in the Realize, the memory
//         in the Allocate: hence two passes.
// Errors: a memoized Func that reads an ImageParam without memoize_tag; one that is stored outside
//         of where it is computed; a tag or eviction key that depends on Vars.
// Source: Halide's documentation of memoize and memoize_tag. Tests: test/unit/memoize_test.cpp.
#include "lower/memoize.h"

#include <unordered_set>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

const LoopedFunc* find_func(const Program& program, const RenamedFuncs& renamed,
                            const std::string& name) {
  const auto it = renamed.find(name);
  return program.find(it == renamed.end() ? name : it->second);
}

bool is_memoized(const LoopedFunc* f) { return f && f->schedule.memoized; }

std::string key_name(const std::string& func) { return func + ".memoization_key"; }

// ---- what a key is made of ----

class Dependencies {
 public:
  explicit Dependencies(const LoopedFunc& f) : f_(f) { visit(*f.func); }
  std::vector<Expr> parts;  // scalar Params and tags, in first-use order

 private:
  void visit(const FuncContents& f) {
    if (!funcs_.insert(&f).second) return;
    for (int s = 0; s < f.stage_count(); s++)
      for_each_expr(f.stage(s), [&](const Expr& e) { visit(e); });
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
    if (param->is_buffer) return parts.push_back(e);  // a fact of its shape
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
  for (const StorageRule& rule : f.schedule.storage_rules) {
    if (!rule.alignment.defined() && !rule.bound.defined()) continue;
    unsupported("memoize " + quoted(f.name()),
                "the storage of a memoized Func has the extents that are computed",
                "align_storage or bound_storage of " + quoted(rule.var) + " makes it larger",
                "Leave out that directive, or memoize");
  }
  const LoopLevel &compute = f.schedule.compute_level, &store = f.schedule.store_level;
  const bool together =
      store.kind == LoopLevel::Kind::Inlined ||
      (store.kind == compute.kind && store.func == compute.func && store.var == compute.var);
  if (f.is_output) {
    user_error(text("memoize ", quoted(f.name())), "an output is computed by every call",
               "it is an output of the pipeline", "Memoize a Func that the output reads");
  }
  if (together) return;
  user_error(text("memoize ", quoted(f.name())),
             "a memoized Func must be computed whole, where its storage begins",
             "its storage level lies outside of its compute level",
             "Leave store_at and store_root out");
}

class KeyInserter : public Rewriter {
 public:
  KeyInserter(const Program& program, const RenamedFuncs& renamed, const std::string& function,
              const Target& target)
      : program_(program), renamed_(renamed), function_(function), target_(target) {}

 protected:
  Expr rewrite(const Expr& e) override {
    const Call* call = e.as<Call>();
    return call && call->is_op(Op::memoize_tag) ? (*this)(call->args[0]) : children(e);
  }

  Stmt rewrite(const Stmt& s) override {
    if (const Realize* n = s.as<Realize>()) bounds_[n->name] = n->bounds;
    const ProducerConsumer* n = s.as<ProducerConsumer>();
    if (!n || !n->is_producer) return children(s);
    const LoopedFunc* f = find_func(program_, renamed_, n->name);
    if (!is_memoized(f)) return children(s);
    check_schedule(*f);
    return make_let(key_name(n->name), call_op(Op::pack, Handle(), key_of(*f, n->name)),
                    children(s));
  }

 private:
  std::vector<Expr> key_of(const LoopedFunc& f, const std::string& name) {
    std::vector<Expr> key = bytes_of(function_ + "\n" + f.name() + "\n" + target_.to_string());
    for (const Expr& part : Dependencies(f).parts) key.push_back(part);
    const auto bounds = bounds_.find(name);
    RETROGRADE_ASSERT(bounds != bounds_.end(), "no storage of ", name);
    for (const Range& range : bounds->second) {
      key.push_back((*this)(range.min));
      key.push_back((*this)(range.extent));
    }
    return key;
  }

  const Program& program_;
  const RenamedFuncs& renamed_;
  const std::string& function_;
  const Target& target_;
  std::map<std::string, std::vector<Range>> bounds_;
};

// ---- lookups ----

class LookupInserter : public Rewriter {
 public:
  LookupInserter(const Program& program, const RenamedFuncs& renamed)
      : program_(program), renamed_(renamed) {}

 protected:
  Expr rewrite(const Expr& e) override { return e; }

  Stmt rewrite(const Stmt& s) override {
    if (const Allocate* n = s.as<Allocate>()) allocated_[n->name] = {n->type, n->elements};
    if (const LetStmt* n = s.as<LetStmt>()) {
      const ProducerConsumer* producer = n->body.as<ProducerConsumer>();
      if (producer && n->name == key_name(producer->name)) return lookup(*n, *producer);
    }
    return children(s);
  }

 private:
  struct Memory {
    Type type;
    Expr elements;
  };

  Stmt lookup(const LetStmt& let, const ProducerConsumer& producer) {
    const LoopedFunc& f = *find_func(program_, renamed_, producer.name);
    std::vector<Expr> blocks, sizes;
    const size_t count = f.func->types.size();
    for (size_t i = 0; i < count; i++) {
      const std::string name = count == 1 ? producer.name : producer.name + "." + std::to_string(i);
      const Memory& memory = allocated_.at(name);
      blocks.push_back(call_op(Op::address_of, Handle(), {make_load(memory.type, name, Expr(0))}));
      sizes.push_back(binary(Kind::Mul, memory.elements, make_const(Int(64), memory.type.bytes())));
    }
    const std::string name = producer.name + ".memoization";
    const Expr places = variable(name + "_blocks", Handle()),
               bytes = variable(name + "_bytes", Handle());
    const std::vector<Expr> what = {variable(let.name, Handle()), Expr(key_bytes(let.value)),
                                    Expr(static_cast<int32_t>(count)), places, bytes};
    const Expr missing = variable(name + "_missing");
    Stmt body = make_if(missing != 0, make_block({(*this)(let.body), store(f, what)}));
    body = make_let(name + "_missing", call("retrograde_memoization_lookup", what), body);
    body = make_let(name + "_bytes", call_op(Op::pack, Handle(), sizes), body);
    body = make_let(name + "_blocks", call_op(Op::pack, Handle(), blocks), body);
    return make_let(let.name, let.value, body);
  }

  static Stmt store(const LoopedFunc& f, std::vector<Expr> what) {
    const Expr& key = f.schedule.eviction_key;
    if (key.defined()) Dependencies::check_is_constant(f, key, "the eviction key");
    what.push_back(Expr(key.defined() ? 1 : 0));
    what.push_back(key.defined() ? eviction_bits(key) : make_uint_const(UInt(64), 0));
    return make_evaluate(call("retrograde_memoization_store", what));
  }

  // Pointers and numbers of any width, as the 64 bits that evicting is asked for.
  static Expr eviction_bits(const Expr& key) {
    if (key.type().is_handle()) return reinterpret_as(UInt(64), key);
    return cast(UInt(64), key);
  }

  static Expr call(const char* function, std::vector<Expr> args) {
    args.insert(args.begin(), Expr(function));
    return call_op(Op::runtime_call, Int(32), std::move(args));
  }

  static int32_t key_bytes(const Expr& pack) {
    int32_t bytes = 0;
    for (const Expr& part : pack.as<Call>()->args) bytes += part.type().bytes();
    return bytes;
  }

  const Program& program_;
  const RenamedFuncs& renamed_;
  std::map<std::string, Memory> allocated_;
};

bool any_memoized(const Program& program) {
  for (const LoopedFunc& f : program.funcs) {
    if (is_memoized(&f)) return true;
  }
  return false;
}

}  // namespace

Stmt add_memoization_keys(const Stmt& s, const Program& program, const RenamedFuncs& renamed,
                          const std::string& function, const Target& target) {
  return any_memoized(program) ? KeyInserter(program, renamed, function, target)(s) : s;
}

Stmt add_memoization_lookups(const Stmt& s, const Program& program, const RenamedFuncs& renamed) {
  return any_memoized(program) ? LookupInserter(program, renamed)(s) : s;
}

}  // namespace retrograde::ir
