// The option --style of the fuzzers, which selects workloads.
#pragma once

#include <optional>
#include <string>

#include "support/fuzz.h"
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

// Takes the option --style; false if it is another option, or names no style.
inline bool take_style(fuzz::Fuzzer& fuzzer, const std::string& name, const std::string& value,
                       std::optional<fuzz::Workload>& workload) {
  if (name != "--style") return false;
  workload = workload_named(value);
  fuzzer.most_refused = most_workloads_refused;
  return workload.has_value();
}

}  // namespace retrograde::gradient
