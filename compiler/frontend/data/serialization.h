// serialization.h -- stubs of later Halide releases' functions for serialized pipelines; all throw Unsupported.
// A graph of Funcs exists only in the process that built it. compile_to_static_library writes machine code to a
// file, and the compile cache on disk keeps it between runs.
#pragma once

#include <map>
#include <string>

#include "frontend/data/parameter.h"
#include "frontend/run/pipeline.h"

namespace retrograde {

namespace frontend {
[[noreturn]] void refuse_serialization(const char* asked);
}

// Always throws: a pipeline has no serialized form.
// Requires: a pipeline exists only in the process that defines it (Unsupported).
template <typename... Args>
void serialize_pipeline(const Pipeline&, Args&&...) {
  frontend::refuse_serialization("serialize a Pipeline");
}
// Always throws: a pipeline has no serialized form.
template <typename... Args>
Pipeline deserialize_pipeline(Args&&...) {
  frontend::refuse_serialization("deserialize a Pipeline");
}
// Always throws: a pipeline has no serialized form.
template <typename... Args>
std::map<std::string, Parameter> deserialize_parameters(Args&&...) {
  frontend::refuse_serialization("deserialize the parameters of a Pipeline");
}

}  // namespace retrograde
