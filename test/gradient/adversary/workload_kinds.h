// The styles of workloads that the fuzzers' option --style names.
#pragma once

#include <optional>
#include <string>

#include "testing/programs/workloads.h"

namespace retrograde::gradient {

// The largest share of workloads that may be refused: users write such programs.
constexpr double most_workloads_refused = 0.06;

inline std::optional<fuzz::Workload> workload_named(const std::string& name) {
  if (name == "workloads") return fuzz::Workload::Any;
  if (name == "loops") return fuzz::Workload::TimeLoops;
  if (name == "strides") return fuzz::Workload::Strides;
  if (name == "indices") return fuzz::Workload::IndexArrays;
  return {};
}

}  // namespace retrograde::gradient
