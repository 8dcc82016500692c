// stage_company.cpp -- directives that relate a stage to others: compute_with and prefetch.
#include "frontend/func.h"
#include "graph/define.h"
#include "ir/build.h"
#include "ir/literal.h"
#include "ir/print.h"

namespace retrograde {

// ---- compute_with ----

namespace {

std::string level_text(const ir::LoopLevel& level) {
  if (level.kind == ir::LoopLevel::Kind::Root) return quoted("root");
  return level.kind == ir::LoopLevel::Kind::At ? quoted(level.func + "." + level.var)
                                               : quoted("inlined");
}

// 1. The level is a loop. 2. It is of another Func.
void check_fuse_level(const std::string& stage, const std::string& func,
                      const ir::LoopLevel& level) {
  const std::string asked = text("compute ", quoted(stage), " with ", level_text(level));
  if (level.kind != ir::LoopLevel::Kind::At) {
    user_error(asked, "a stage joins the loops of another one down to a loop",
               "the level is " + level_text(level), "Name a stage and one of its loops");
  }
  if (level.func == func) {
    user_error(asked, "the stages belong to different Funcs", "both are of " + quoted(func),
               "Stages of one Func run in their order");
  }
}

// What a stage joins as long as its level object is not set: no loop of any Func.
ir::LoopLevel undefined_level(const LoopLevel& level) {
  const auto object = reinterpret_cast<uintptr_t>(level.contents().get());
  return {ir::LoopLevel::Kind::At, "", std::to_string(object), -1};
}

// What the object says later, the schedule says, unless it was given another level since.
void follow_fuse_level(const ir::FuncPtr& f, int index, const LoopLevel& level) {
  level.contents()->followers.push_back(
      [weak = f->weak_from_this(), index, stage = stage_name(*f, index),
       last = f->stage(index).schedule.fuse_level](const ir::LoopLevel& now) mutable {
        const auto func = weak.lock();
        if (!func || !(func->stage(index).schedule.fuse_level == last)) return;
        check_fuse_level(stage, func->name, now);
        last = func->stage(index).schedule.fuse_level = now;
        func->version++;
      });
}

}  // namespace

// 1. and 2. as above, now or when the level is set. 3. This stage has no specializations and is no
// extern stage. Whether the loops agree and nothing depends on each other is checked when the whole
// schedule is known.
Stage& Stage::compute_with(const LoopLevel& level,
                           const std::vector<std::pair<VarOrRVar, LoopAlignStrategy>>& align) {
  if (level.defined()) check_fuse_level(name(), func_->name, level.contents()->level);
  const std::string asked =
      text("compute ", quoted(name()), " with ",
           level.defined() ? level_text(level.contents()->level) : "another stage");
  if (func_->is_extern()) {
    user_error(asked, "the stage has loops", quoted(func_->name) + " is computed by a C function",
               "Schedule another stage");
  }
  if (!schedule().specializations.empty() || !specialization_.empty()) {
    user_error(asked, "a stage that joins the loops of another one has no specializations",
               text(quoted(name()), " has ", schedule().specializations.size()),
               "Specialize the other stage instead");
  }
  ir::StageSchedule& now = touch();
  now.fuse_level = level.defined() ? level.contents()->level : undefined_level(level);
  now.fuse_alignment.clear();
  for (const auto& [var, strategy] : align) now.fuse_alignment[var.name()] = strategy;
  follow_fuse_level(func_, index_, level);
  return *this;
}

Stage& Stage::compute_with(const LoopLevel& level, LoopAlignStrategy align) {
  compute_with(level, std::vector<std::pair<VarOrRVar, LoopAlignStrategy>>{});
  if (align == LoopAlignStrategy::Auto) return *this;
  ir::StageSchedule& now = touch();
  for (const ir::Dim& dim : now.dims) now.fuse_alignment[dim.var] = align;
  return *this;
}

namespace {

LoopLevel level_of(const Stage& stage, const VarOrRVar& var) {
  return LoopLevel(Func(stage.function()), var, stage.index());
}

}  // namespace

Stage& Stage::compute_with(const Stage& stage, const VarOrRVar& var,
                           const std::vector<std::pair<VarOrRVar, LoopAlignStrategy>>& align) {
  return compute_with(level_of(stage, var), align);
}

Stage& Stage::compute_with(const Stage& stage, const VarOrRVar& var, LoopAlignStrategy align) {
  return compute_with(level_of(stage, var), align);
}

// ---- prefetch ----

Stage& Stage::prefetch(const Func& f, const VarOrRVar& at, const VarOrRVar& from, Expr offset,
                       PrefetchBoundStrategy strategy) {
  if (!f.defined()) {
    user_error(text("prefetch ", quoted(f.name()), " for ", quoted(name())),
               "it needs a definition first", "it has none", "Define it: f(x, y) = ...");
  }
  // Weak: what is prefetched may be any Func of the pipeline.
  return add_prefetch(f.name(), ir::SymbolRef::weak(f.function()->shared_from_this()), at, from,
                      std::move(offset), strategy);
}

Stage& Stage::prefetch(const std::shared_ptr<ir::ParameterContents>& image, const VarOrRVar& at,
                       const VarOrRVar& from, Expr offset, PrefetchBoundStrategy strategy) {
  if (!image || !image->is_buffer) {
    user_error("prefetch for " + quoted(name()), "it is a Func or an image that is prefetched",
               image ? quoted(image->name) + " is a scalar" : std::string("it is undefined"),
               "Name a Func or an ImageParam");
  }
  return add_prefetch(image->name, ir::SymbolRef(image), at, from, std::move(offset), strategy);
}

// 1. Both loops exist, and `at` is `from` or inside of it. 2. The offset is an integer that is known
// when a call begins.
Stage& Stage::add_prefetch(std::string what, ir::SymbolRef symbol, const VarOrRVar& at,
                           const VarOrRVar& from, Expr offset, PrefetchBoundStrategy strategy) {
  const std::string asked = text("prefetch ", quoted(what), " for ", quoted(name()), " at ",
                                 quoted(at.name()), " from ", quoted(from.name()));
  const size_t inner = loop_index(at, asked), outer = loop_index(from, asked);
  if (inner > outer) {
    user_error(asked, "the loop it happens at is the one it counts from, or inside of it",
               text(quoted(at.name()), " is around ", quoted(from.name())), "Swap them");
  }
  if (!offset.defined() || !offset.type().is_int_or_uint() || !offset.type().is_scalar()) {
    user_error(asked, "the offset is an integer",
               offset.defined() ? text(offset, " has type ", to_string(offset.type()))
                                : std::string("it is undefined"),
               "Give an integer");
  }
  ir::check_over_parameters(offset, "the offset", asked);
  ir::PrefetchDirective directive;
  directive.name = std::move(what);
  directive.symbol = std::move(symbol);
  directive.at = at.name();
  directive.from = from.name();
  directive.offset = ir::int32_literal(std::move(offset), asked);
  directive.strategy = strategy;
  touch().prefetches.push_back(std::move(directive));
  return *this;
}

}  // namespace retrograde
