// pipeline_contents.h -- the state that handles to one Pipeline share.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "frontend/run/pipeline.h"
#include "graph/directives/wrappers.h"

namespace retrograde {

namespace frontend {

using ParameterPtr = std::shared_ptr<graph::ParameterContents>;

// The versions of everything that compiled code depends on. Code is up to date if its stamp is equal.
struct Stamp {
  std::vector<std::pair<graph::FuncPtr, uint64_t>> funcs;
  std::vector<std::pair<ParameterPtr, uint64_t>> parameters;

  static Stamp of(const PipelineSpec& pipeline) {
    Stamp result;
    result.add(pipeline);
    return result;
  }
  void add(const PipelineSpec& pipeline) {
    for (const graph::FuncPtr& f : graph::functions_of(pipeline.outputs))
      funcs.emplace_back(f, f->version);
    for (const ParameterPtr& p : graph::parameters_of(pipeline.outputs))
      parameters.emplace_back(p, p->version);
    for (const graph::FuncPtr& f : pipeline.outputs) {
      for (const ParameterPtr& p : f->outputs) parameters.emplace_back(p, p->version);
    }
    for (const auto& [name, called] : pipeline.pipelines) add(*called);
  }
  bool is_current() const {
    const auto is_same = [](const auto& seen) { return seen.first->version == seen.second; };
    return std::ranges::all_of(funcs, is_same) && std::ranges::all_of(parameters, is_same);
  }
};

}  // namespace frontend

struct Pipeline::Contents {
  std::vector<graph::FuncPtr> outputs;
  JITHandlers handlers;
  std::map<std::string, JITExtern> externs;
  bool is_traced = false;
  AutoscheduleOptions autoschedule;
  std::mutex mutex;
  // The latest compilation.
  std::shared_ptr<CompiledPipeline> compiled;
  Target target;
  frontend::Stamp stamp;
};

}  // namespace retrograde
