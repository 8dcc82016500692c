#include "lower/nests/extern_stage.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/runtime_call.h"

namespace retrograde::lower {

namespace {

// Of one halide_buffer_t: where its first element lies, and its dimensions.
struct Descriptor {
  Expr host;  // a null handle when there is no memory
  Type type;
  std::vector<Range> region;
  std::vector<Expr> strides;
};

// The fields of halide_buffer_t and halide_dimension_t, in their order and without gaps.
Expr packed(const Descriptor& d) {
  std::vector<Expr> dims;
  for (size_t i = 0; i < d.region.size(); i++) {
    dims.push_back(cast(Int(32), d.region[i].min));
    dims.push_back(cast(Int(32), d.region[i].extent));
    dims.push_back(cast(Int(32), d.strides[i]));
    dims.push_back(make_uint_const(UInt(32), 0));  // flags
  }
  const Expr zero = make_uint_const(UInt(64), 0);
  return pack({/*device*/ zero, /*device_interface*/ null_handle(), d.host, /*flags*/ zero,
               make_uint_const(UInt(32), type_word(d.type)),
               Expr(static_cast<int32_t>(d.region.size())), pack(dims),
               /*padding*/ null_handle()});
}

std::vector<Expr> dense_strides(const std::vector<Range>& region) {
  std::vector<Expr> strides;
  Expr stride = 1;
  for (const Range& range : region) {
    strides.push_back(stride);
    stride = stride * range.extent;
  }
  return strides;
}

class Emitter {
 public:
  Emitter(const Program& program, const LoopedFunc& f, const Domain& region)
      : program_(program), f_(f), definition_(*f.func->extern_definition) {
    for (const std::string& arg : f.func->args) region_.push_back(region.at(arg));
    prefix_ = stage_prefix(f.name(), 0);
  }

  ExternStage emit() {
    check();
    if (has_funcs()) query();
    stage_.call = call();
    return std::move(stage_);
  }

 private:
  const Program& program_;
  const LoopedFunc& f_;
  const ExternDefinition& definition_;
  std::vector<Range> region_;
  std::string prefix_;
  ExternStage stage_;

  static bool is_func(const ExternArgument& arg) { return arg.kind == ExternArgument::Kind::Func; }

  bool has_funcs() const { return std::ranges::any_of(definition_.args, is_func); }

  void check() const {
    const std::string asked =
        text("compute ", quoted(f_.name()), " by the C function ", quoted(definition_.function));
    if (definition_.mangling == NameMangling::CPlusPlus) {
      unsupported(asked, "the function's symbol is its plain name",
                  "its name was said to be mangled as C++ does", "Declare it extern \"C\"");
    }
    check_dense(f_, asked);
    for (const ExternArgument& arg : definition_.args) {
      if (!is_func(arg)) continue;
      const LoopedFunc* input = program_.find(arg.func->name);
      if (!input) {
        user_error(asked, "a Func that a C function reads has memory",
                   text(quoted(arg.func->name), " is inlined"),
                   text("Call compute_root() or compute_at() on ", quoted(arg.func->name)));
      }
      check_dense(*input, asked);
    }
  }

  // A buffer has no way to say that coordinates wrap around.
  static void check_dense(const LoopedFunc& f, const std::string& asked) {
    for (const StorageRule& rule : f.schedule.storage_rules) {
      if (!rule.fold.defined()) continue;
      user_error(asked, "what a C function reads or writes lies in memory as one box",
                 text("the storage of ", quoted(f.name()), " is folded over ", quoted(rule.var)),
                 "Leave fold_storage out");
    }
    if (is_stored_where_computed(f) || f.is_output) return;
    unsupported(asked, "what a C function reads or writes is stored where it is computed",
                text(quoted(f.name()), " is stored outside of its compute level"),
                "Leave store_at and store_root out");
  }

  Expr bind(const std::string& name, const Expr& value) {
    stage_.bindings.emplace_back(prefix_ + name, value);
    return variable(prefix_ + name, value.type());
  }

  // ---- the query ----

  // One buffer without memory for each value of each Func; what the function wrote into them is
  // read back through the call itself.
  void query() {
    std::vector<Expr> args;
    struct Asked {
      const FuncContents* func;
      Expr buffer;
    };
    std::vector<Asked> asked;
    for (const ExternArgument& arg : definition_.args) {
      if (!is_func(arg)) {
        args.push_back(other_argument(arg));
        continue;
      }
      for (size_t i = 0; i < arg.func->types.size(); i++) {
        const std::vector<Range> nothing(arg.func->args.size(), Range{0, 0});
        const Descriptor empty{null_handle(), arg.func->types[i], nothing, dense_strides(nothing)};
        const Expr buffer = bind(text("query.", args.size()), packed(empty));
        args.push_back(buffer);
        asked.push_back({arg.func.get(), buffer});
      }
    }
    for (size_t i = 0; i < f_.func->types.size(); i++) {
      const Descriptor wanted{null_handle(), f_.func->types[i], region_, dense_strides(region_)};
      args.push_back(bind(text("query.", args.size()), packed(wanted)));
    }
    const Expr code = bind("query.code", call_extern(definition_.function, Int(32), args));
    for (const Asked& input : asked) add_use(*input.func, input.buffer, code);
  }

  void add_use(const FuncContents& func, const Expr& buffer, const Expr& code) {
    Footprint use;
    for (int d = 0; d < func.dimensions(); d++) {
      const auto field = [&](Op op) {
        return call_op(Op::require, Int(32),
                       {code == 0, call_op(op, Int(32), {buffer, Expr(d)}), failed(code)});
      };
      const Expr min = field(Op::buffer_min), extent = field(Op::buffer_extent);
      use.box.push_back({min, min + extent - 1});
    }
    Requirements uses;
    uses[func.name] = std::move(use);
    merge_footprints(stage_.uses, uses);
  }

  Expr failed(const Expr& code) const {
    return call_op(Op::error, Int(32),
                   {code,
                    Expr(text("cannot compute ", quoted(f_.name()), ": the C function ",
                              quoted(definition_.function), " returned the error code ")),
                    code, Expr(". Look up what the function means by it.")});
  }

  // ---- the call ----

  Stmt call() {
    std::vector<Expr> args;
    for (const ExternArgument& arg : definition_.args) {
      if (!is_func(arg)) {
        args.push_back(other_argument(arg));
        continue;
      }
      const LoopedFunc& input = *program_.find(arg.func->name);
      std::vector<Range> region;
      for (const Interval& side : stage_.uses.at(arg.func->name).box)
        region.push_back({side.min, side.max - side.min + 1});
      for (size_t i = 0; i < arg.func->types.size(); i++)
        args.push_back(packed(of_func(input, static_cast<int>(i), region)));
    }
    for (size_t i = 0; i < f_.func->types.size(); i++)
      args.push_back(packed(of_func(f_, static_cast<int>(i), region_)));
    const std::string code = prefix_ + "code";
    const Expr result = variable(code);
    return make_let(code, call_extern(definition_.function, Int(32), args),
                    make_assert(result == 0, failed(result)));
  }

  static Descriptor of_func(const LoopedFunc& f, int value, const std::vector<Range>& region) {
    const std::string buffer = f.is_output ? value_buffer_name(*f.func, value) : f.name();
    Descriptor d{{}, f.func->types[static_cast<size_t>(value)], region, {}};
    std::vector<Expr> first;
    for (size_t i = 0; i < region.size(); i++) {
      first.push_back(region[i].min);
      d.strides.push_back(variable(text(buffer, ".stride.", i)));
    }
    d.host = call_op(Op::address_of, Handle(),
                     {call_func(f.name(), d.type, first, value, SymbolRef(f.func))});
    return d;
  }

  static Expr other_argument(const ExternArgument& arg) {
    if (arg.kind == ExternArgument::Kind::Expr) return arg.expr;
    return variable(arg.buffer->name + ".buffer", Handle(), SymbolRef(arg.buffer));
  }
};

}  // namespace

Expr packed_buffer(Type type, const Expr& host, const std::vector<Range>& region,
                   const std::vector<Expr>& strides) {
  return packed({host, type, region, strides});
}

ExternStage emit_extern_stage(const Program& program, const LoopedFunc& f, const Domain& region) {
  return Emitter(program, f, region).emit();
}

}  // namespace retrograde::lower
