// serialization.h -- names of later Halide releases for storing pipelines as bytes: Unsupported. A
// Func graph has no form outside the process; what compile_to_static_library writes has, and the
// compile cache on disk keeps machine code from run to run.
#pragma once

#include <map>
#include <string>

#include "frontend/data/parameter.h"
#include "frontend/run/pipeline.h"

namespace retrograde {

namespace frontend {
[[noreturn]] void refuse_serialization(const char* asked);
}

// Requires: pipelines live in the process that defines them (Unsupported).
template <typename... Args>
void serialize_pipeline(const Pipeline&, Args&&...) {
  frontend::refuse_serialization("serialize a Pipeline");
}
template <typename... Args>
Pipeline deserialize_pipeline(Args&&...) {
  frontend::refuse_serialization("deserialize a Pipeline");
}
template <typename... Args>
std::map<std::string, Parameter> deserialize_parameters(Args&&...) {
  frontend::refuse_serialization("deserialize the parameters of a Pipeline");
}

}  // namespace retrograde
