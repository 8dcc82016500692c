// stage.cpp -- helpers of the loop directives; graph/directives/give_directive.h has their rules.
#include "frontend/schedule/stage.h"

#include <algorithm>

#include "frontend/language/func.h"
#include "graph/definitions/define.h"
#include "graph/definitions/rfactor.h"

namespace retrograde {

namespace {

std::string as_list(const std::vector<VarOrRVar>& vars) {
  return listed(vars, [](const VarOrRVar& var) { return quoted(var.name()); });
}

}  // namespace

namespace frontend {

ReorderLoops reorder_of(const std::vector<VarOrRVar>& vars) {
  ReorderLoops order;
  for (const VarOrRVar& var : vars) order.loops.emplace_back(var.name());
  return order;
}

std::vector<VarOrRVar> loops_at(const SchedulePlace& place) {
  return mapped(place.schedule().dims,
                [&](const Dim& dim) { return VarOrRVar(dim.var, dim.is_reduction); });
}

VarOrRVar fresh_like(const VarOrRVar& var) {
  return var.is_rvar ? VarOrRVar(RVar()) : VarOrRVar(Var());
}

retrograde::LoopLevel level_of(const Stage& stage, const VarOrRVar& var) {
  return retrograde::LoopLevel(Func(stage.function()), var, stage.index());
}

void check_tile(const SchedulePlace& place, const std::vector<VarOrRVar>& loops,
                const std::vector<size_t>& sizes) {
  if (std::ranges::all_of(sizes, [&](size_t n) { return n == loops.size(); })) return;
  user_error(text("tile ", as_list(loops), " of ", place.name()), "all lists have one length",
             text("they have ", loops.size(), " loops, ", sizes[0], " outer and ", sizes[1],
                  " inner names, ", sizes[2], " factors and ", sizes[3], " tail strategies"),
             "Give lists of one length");
}

PrefetchData prefetch_of(const SchedulePlace& place, const Func& f, PrefetchData prefetch) {
  if (!f.defined()) {
    user_error(text("prefetch ", quoted(f.name()), " for ", place.name()),
               "it needs a definition first", "it has none", "Define it: f(x, y) = ...");
  }
  prefetch.source = f.name();
  // A weak reference avoids a cycle: the prefetched Func may be any Func of the pipeline.
  prefetch.symbol = SymbolRef::weak(f.function()->shared_from_this());
  return prefetch;
}

PrefetchData prefetch_of(const SchedulePlace& place,
                         const std::shared_ptr<ParameterContents>& image, PrefetchData prefetch) {
  if (!image || !image->is_buffer) {
    user_error("prefetch for " + place.name(), "it is a Func or an image that is prefetched",
               image ? quoted(image->name) + " is a scalar" : std::string("it is undefined"),
               "Name a Func or an ImageParam");
  }
  prefetch.source = image->name;
  prefetch.symbol = SymbolRef(image);
  return prefetch;
}

// Directives for unsupported devices are declared, and throw, so that programs that mention them compile.
void check_device(const SchedulePlace& place, const std::vector<VarOrRVar>& loops,
                  DeviceAPI device) {
  if (device == DeviceAPI::Default_GPU || device == DeviceAPI::CUDA) return;
  const std::string asked = text("run ", as_list(loops), " of ", place.name(), " on ");
  if (device == DeviceAPI::Hexagon) {
    unsupported(asked + "a Hexagon accelerator", "loops run on the CPU or a CUDA device",
                "no code is generated for Hexagon", "Use parallel, vectorize and tile instead");
  }
  if (device == DeviceAPI::Host || device == DeviceAPI::None) {
    user_error(asked + "a GPU", "a directive for GPUs names a GPU", "it names the host",
               "Leave the device out, or use parallel, vectorize and tile");
  }
  unsupported(asked + "a GPU", "code for GPUs is generated for CUDA",
              "the directive names another kind of device",
              "Leave the device out, or give DeviceAPI::CUDA");
}

void check_run(const SchedulePlace& place, const VarOrRVar& loop, ForType kind) {
  Directive run = graph::RunLoop{loop.name(), kind};
  check_directive(place, run);
}

}  // namespace frontend

std::string Stage::name() const { return graph::stage_name(*place_.f, place_.stage); }
std::string Stage::source_location() const { return graph::source_location_of(*place_.f); }
std::vector<VarOrRVar> Stage::split_vars() const { return frontend::loops_at(place_); }

std::string Stage::dump_argument_list() const {
  return listed(get_schedule().dims, [](const graph::Dim& dim) { return dim.var; });
}

Func Stage::rfactor(const RVar& r, const Var& v) {
  return rfactor(std::vector<std::pair<RVar, Var>>{{r, v}});
}
Func Stage::rfactor(const std::vector<std::pair<RVar, Var>>& preserved) {
  std::vector<std::pair<graph::NamedLoop, std::string>> names;
  for (const auto& [rvar, var] : preserved) names.emplace_back(rvar.name(), var.name());
  return Func(graph::factor_out(place_, names));
}

}  // namespace retrograde
