// call.h -- calls of compiled code: checks and binds the arguments, selects the handlers, and reports the error.
#pragma once

#include <string>
#include <vector>

#include "frontend/run/compiled_pipeline.h"
#include "frontend/run/param_map.h"
#include "ir/visit.h"

namespace retrograde::frontend {

// Checks that do not depend on the code: null, type, rank, extents, memory. Throws RuntimeError.
void check_buffer(const halide_buffer_t* buffer, const std::string& name, Type type, int dimensions,
                  bool with_memory, const std::string& asked);
// The bytes of a scalar as generated code reads them.
uint64_t scalar_bits(const Scalar& value);
// Throws RuntimeError if the value is outside of the parameter's limits.
void check_limits(const ParameterContents& parameter, const Scalar& value,
                  const std::string& asked);

// The argument vector of a call. Values come from `map`, or from the parameters if the map has none. Holds
// scalars and query buffers during the call.
class Arguments {
 public:
  using ParameterPtr = std::shared_ptr<ParameterContents>;
  // `is_query`: an image without a buffer gets an empty one, whose shape the code then sets.
  Arguments(const CompiledPipeline& code, std::vector<halide_buffer_t*> outputs, bool is_query,
            std::string asked, const ParamMap& map);
  void* const* argv() const { return argv_.data(); }

  struct Query {
    ParameterPtr parameter;
    Runtime::Buffer<> buffer;
  };
  std::vector<Query>& queries() { return queries_; }

 private:
  const std::string asked_;
  const ParamMap& map_;
  std::vector<halide_buffer_t*> outputs_;
  size_t next_output_ = 0;
  std::vector<uint64_t> scalars_;
  std::vector<Query> queries_;
  std::vector<void*> argv_;

  void* bind(const LoweredArgument& arg, bool is_query);
  void* bind_scalar(const ParameterPtr& parameter);
  void* bind_buffer(const ParameterPtr& parameter, bool is_query);
};

// Combines handlers; those of `first` take precedence.
JITHandlers merged(JITHandlers handlers, const JITHandlers& first);

// Runs `prepare`, which checks and binds the arguments of a call. If there is an error handler, it receives a
// RuntimeError, and the nonzero code is returned.
int prepared(const JITHandlers& own, JITUserContext* user, FunctionRef<void()> prepare);

// Runs compiled code. Handlers of `user` take precedence over `own`. An error throws RuntimeError; if an
// error handler receives it, its code is returned instead.
int call(const CompiledPipeline& code, const JITHandlers& own, void* const* argv,
         const std::string& asked, JITUserContext* user);

}  // namespace retrograde::frontend
