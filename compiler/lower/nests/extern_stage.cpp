#include "lower/nests/extern_stage.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/checks/run_time_check.h"
#include "lower/nests/emitted.h"
#include "lower/runtime_call.h"
#include "retrograde_runtime.h"

namespace retrograde::lower {

namespace {

// The contents of a halide_buffer_t.
struct Descriptor {
  Expr host;  // the address of its first element; a null handle if there is no memory
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

bool is_func(const ExternArgument& arg) { return arg.kind == ExternArgument::Kind::Func; }
bool is_image(const ExternArgument& arg) { return arg.kind == ExternArgument::Kind::Buffer; }

const std::string& name_of(const ExternArgument& arg) {
  return is_func(arg) ? arg.func->name : arg.buffer->name;
}

Expr failed(const LoopedFunc& f, const Expr& code) {
  return call_op(
      Op::error, Int(32),
      {code,
       Expr(text("cannot compute ", quoted(f.name()), ": the C function ",
                 quoted(f.func->extern_definition->function), " returned the error code ")),
       code, Expr(". Look up what the function means by it.")});
}

std::vector<Range> ranges_of(const Box& box) {
  return mapped(box, [](const Interval& side) { return Range{side.min, side.max - side.min + 1}; });
}

// One query: calls the function with descriptors without memory, and reads back what it wrote into them.
class Query {
 public:
  // `prefix`: of the names to bind.
  Query(const LoopedFunc& f, const std::string& prefix, Lets& bindings)
      : f_(f), definition_(*f.func->extern_definition), prefix_(prefix), bindings_(bindings) {}

  void ask(const Box& region) {
    std::vector<Expr> args;
    for (const ExternArgument& arg : definition_.args) {
      if (is_func(arg)) {
        const std::vector<Range> nothing(arg.func->args.size(), Range{0, 0});
        for (const Type type : arg.func->types) add_input(arg, type, nothing, args);
      } else if (is_image(arg)) {
        // Its actual size, so that inputs that the function does not query have no further requirements.
        std::vector<Range> actual;
        for (int d = 0; d < arg.buffer->dimensions; d++) actual.push_back(range_of_image(arg, d));
        add_input(arg, arg.buffer->type, actual, args);
      } else {
        args.push_back(arg.expr);
      }
    }
    const std::vector<Range> wanted = ranges_of(region);
    for (const Type type : f_.func->types) {
      args.push_back(bind(text("query.", args.size()),
                          packed({null_handle(), type, wanted, dense_strides(wanted)})));
      outputs_.push_back(args.back());
    }
    code_ = bind("query.code", call_extern(definition_.function, Int(32), args));
  }

  // The region that the function wants to compute, at least the requested one.
  Box computed(const Box& region) const {
    Box result = region;
    for (const Expr& buffer : outputs_) result = hull(result, box_in(buffer, region.size()));
    return simplified(result);
  }

  // The regions that the function reads of each Func and image. For an existing image all of it counts as available,
  // because the function sees its size.
  Requirements inputs() const {
    Requirements result;
    for (const auto& [arg, buffer] : inputs_) {
      Footprint use;
      if (is_func(*arg)) {
        use.box = box_in(buffer, arg->func->args.size());
      } else {
        const Expr is_asked =
            call_op(Op::buffer_is_query, Bool(), {variable(name_of(*arg) + ".buffer", Handle())});
        use.is_image = true;
        use.symbol = SymbolRef(arg->buffer);
        use.box = box_in(buffer, static_cast<size_t>(arg->buffer->dimensions));
        for (int d = 0; d < arg->buffer->dimensions; d++) {
          Interval& side = use.box[static_cast<size_t>(d)];
          const Range actual = range_of_image(*arg, d);
          side.min = make_select(is_asked, side.min, actual.min);
          side.max = make_select(is_asked, side.max, actual.min + actual.extent - 1);
        }
      }
      const Requirements one{{name_of(*arg), use}};
      merge_footprints(result, one);
    }
    return result;
  }

 private:
  const LoopedFunc& f_;
  const ExternDefinition& definition_;
  const std::string prefix_;
  Lets& bindings_;
  std::vector<std::pair<const ExternArgument*, Expr>> inputs_;
  std::vector<Expr> outputs_;
  Expr code_;

  Expr bind(const std::string& name, const Expr& value) {
    bindings_.emplace_back(prefix_ + name, value);
    return variable(prefix_ + name, value.type());
  }
  void add_input(const ExternArgument& arg, Type type, const std::vector<Range>& region,
                 std::vector<Expr>& args) {
    args.push_back(bind(text("query.", args.size()),
                        packed({null_handle(), type, region, dense_strides(region)})));
    inputs_.emplace_back(&arg, args.back());
  }
  static Range range_of_image(const ExternArgument& arg, int d) {
    return metadata_range(arg.buffer->name, d);
  }
  Box box_in(const Expr& buffer, size_t dimensions) const {
    const auto field = [&](Op op, int d) {
      return call_op(Op::require, Int(32),
                     {code_ == 0, call_op(op, Int(32), {buffer, Expr(d)}), failed(f_, code_)});
    };
    return numbered(static_cast<int>(dimensions), [&](int d) {
      const Expr min = field(Op::buffer_min, d);
      return Interval{min, min + field(Op::buffer_extent, d) - 1};
    });
  }
};

// Binds names to the ends of the box, and returns the box in terms of them.
Box bind_box(const std::string& name, const Box& box, Lets& bindings) {
  Box named = box;
  for (size_t d = 0; d < box.size(); d++) {
    for (const auto& [end, what] :
         {std::pair(&Interval::min, ".min."), std::pair(&Interval::max, ".max.")}) {
      const std::string full = name + what + std::to_string(d);
      bindings.emplace_back(full, box[d].*end);
      named[d].*end = variable(full);
    }
  }
  return named;
}

std::string prefix_of(const LoopedFunc& f) { return stage_prefix(f.name(), 0); }
std::string whole_prefix(const LoopedFunc& f) { return prefix_of(f) + "whole."; }

}  // namespace

static ExternAnswer ask_extern_stage(const LoopedFunc& f, const Box& region,
                                     const std::string& prefix, bool may_enlarge);

namespace {

class Emitter {
 public:
  Emitter(const Program& program, const LoopedFunc& f, const ExternCall& call)
      : program_(program),
        f_(f),
        definition_(*f.func->extern_definition),
        prefix_(prefix_of(f)),
        call_(call) {}

  ExternStage emit() {
    check();
    const bool may_enlarge = !f_.is_output && !call_.is_slice;
    const ExternAnswer answer = ask_extern_stage(f_, call_.region, prefix_, may_enlarge);
    stage_.bindings = answer.bindings;
    stage_.computed = answer.computed;
    stage_.uses = answer.uses;
    if (call_.in_loops) note_parts();
    stage_.call = call();
    return std::move(stage_);
  }

 private:
  const Program& program_;
  const LoopedFunc& f_;
  const ExternDefinition& definition_;
  const std::string prefix_;
  const ExternCall& call_;
  ExternStage stage_;

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

  // A buffer descriptor cannot express folded storage.
  static void check_dense(const LoopedFunc& f, const std::string& asked) {
    for (const StorageRule& rule : f.schedule.storage_rules) {
      if (!rule.fold.defined()) continue;
      user_error(asked, "what a C function reads or writes lies in memory as one box",
                 text("the storage of ", quoted(f.name()), " is folded over ", quoted(rule.var)),
                 "Leave fold_storage out");
    }
  }

  // Inside of a loop, records the complete region of each input for code further out.
  void note_parts() {
    for (auto& [name, use] : stage_.uses) {
      if (use.is_image) continue;
      const Box part = bind_box(prefix_ + "asked." + name, use.box, stage_.bindings);
      for (size_t d = 0; d < part.size(); d++) {
        const auto end = [&](const char* what) {
          return variable(whole_prefix(f_) + "asked." + name + what + std::to_string(d));
        };
        const Interval whole{end(".min."), end(".max.")};
        for (const Expr& e : {part[d].min, part[d].max})
          stage_.parts.emplace_back(e.as<Variable>()->name, whole);
        stage_.checks.push_back(inside_check(name, static_cast<int>(d), part[d], whole));
      }
      use.box = part;
    }
  }

  Stmt inside_check(const std::string& input, int d, const Interval& part,
                    const Interval& whole) const {
    const Expr is_inside = part.min > part.max || (part.min >= whole.min && part.max <= whole.max);
    return run_time_check(
        is_inside, retrograde_error_access_out_of_bounds,
        text("cannot compute ", quoted(f_.name()), ": the C function ",
             quoted(definition_.function),
             " asks for no more for a part of its output than for the whole; in dimension ", d,
             " of ", quoted(input), " it asks for ["),
        part.min, Expr(", "), part.max, Expr("] for a part and for ["), whole.min, Expr(", "),
        whole.max, Expr("] for the whole. Compute the stage at root."));
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
      const std::vector<Range> region = ranges_of(stage_.uses.at(arg.func->name).box);
      for (size_t i = 0; i < arg.func->types.size(); i++)
        args.push_back(packed(of_func(input, static_cast<int>(i), region)));
    }
    for (size_t i = 0; i < f_.func->types.size(); i++)
      args.push_back(packed(of_func(f_, static_cast<int>(i), ranges_of(stage_.computed))));
    const std::string code = prefix_ + "code";
    const Expr result = variable(code);
    std::vector<Stmt> stmts = stage_.checks;
    stmts.push_back(make_let(code, call_extern(definition_.function, Int(32), args),
                             make_assert(result == 0, failed(f_, result))));
    return make_block(std::move(stmts));
  }

  static Descriptor of_func(const LoopedFunc& f, int value, const std::vector<Range>& region) {
    const std::string buffer = f.is_output ? value_buffer_name(*f.func, value) : f.name();
    Descriptor d{{}, f.func->types[static_cast<size_t>(value)], region, {}};
    std::vector<Expr> first;
    for (size_t i = 0; i < region.size(); i++) {
      first.push_back(region[i].min);
      d.strides.push_back(metadata(buffer, Metadata::Stride, i));
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

// Queries a function that enlarges its output a second time, for the inputs of the enlarged output.
static ExternAnswer ask_extern_stage(const LoopedFunc& f, const Box& region,
                                     const std::string& prefix, bool may_enlarge) {
  ExternAnswer answer;
  answer.computed = region;
  if (may_enlarge) {
    Query query(f, prefix + "size.", answer.bindings);
    query.ask(region);
    answer.computed = bind_box(prefix + "computed", query.computed(region), answer.bindings);
  }
  const auto is_input = [](const ExternArgument& arg) { return is_func(arg) || is_image(arg); };
  if (std::ranges::none_of(f.func->extern_definition->args, is_input)) return answer;
  Query query(f, prefix, answer.bindings);
  query.ask(answer.computed);
  answer.uses = query.inputs();
  return answer;
}

ExternStage emit_extern_stage(const Program& program, const LoopedFunc& f, const ExternCall& call) {
  return Emitter(program, f, call).emit();
}

std::string whole_region_of(const LoopedFunc& f) { return whole_prefix(f) + "region"; }

ExternAnswer ask_for_whole(const LoopedFunc& f, const Box& region) {
  const std::string prefix = whole_prefix(f);
  const bool may_enlarge = !f.is_output;
  ExternAnswer whole = ask_extern_stage(f, region, prefix, may_enlarge);
  Box first = region, last = region;
  for (size_t d = 0; d < region.size(); d++) {
    first[d].max = min(region[d].min, region[d].max);  // stays empty if the region is empty
    last[d].min = max(region[d].min, region[d].max);
  }
  for (const auto& [corner, name] : {std::pair(&first, "first."), std::pair(&last, "last.")}) {
    ExternAnswer part = ask_extern_stage(f, *corner, prefix + name, may_enlarge);
    append(whole.bindings, part.bindings);
    merge_footprints(whole.uses, part.uses);
  }
  for (auto& [name, use] : whole.uses) {
    if (!use.is_image) use.box = bind_box(prefix + "asked." + name, use.box, whole.bindings);
  }
  return whole;
}

}  // namespace retrograde::lower
