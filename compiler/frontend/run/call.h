// call.h -- one call of compiled code: its arguments, checked and in place; its handlers; its
// error.
#pragma once

#include <string>
#include <vector>

#include "frontend/run/compiler_interface.h"
#include "frontend/run/param_map.h"
#include "ir/visit.h"

namespace retrograde::frontend {

// Checks that do not depend on the code: null, type, dimensions, extents, memory. RuntimeError.
void check_buffer(const halide_buffer_t* buffer, const std::string& name, Type type, int dimensions,
                  bool with_memory, const std::string& asked);
// The bytes of a scalar as generated code reads them.
uint64_t scalar_bits(const Scalar& value);
// RuntimeError when the value is outside of the parameter's limits.
void check_limits(const ParameterContents& parameter, const Scalar& value,
                  const std::string& asked);

// What compiled code is called with: values from `map`, and what it does not name from the
// parameters. Scalars and query buffers live here while it runs.
class Arguments {
 public:
  using ParameterPtr = std::shared_ptr<ParameterContents>;
  // `is_query`: an image without a buffer gets an empty one, for the code to write its region into.
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

// Handlers with others in front of them.
JITHandlers merged(JITHandlers handlers, const JITHandlers& first);

// Runs what checks and binds the arguments of a call. A RuntimeError goes to the handler of errors
// where there is one: then its code is returned, which is not 0.
int prepared(const JITHandlers& own, JITUserContext* user, FunctionRef<void()> prepare);

// Runs it. The handlers of `user` go before `own`. RuntimeError for an error; where a handler was
// told of it, the error code is returned instead.
int call(const CompiledPipeline& code, const JITHandlers& own, void* const* argv,
         const std::string& asked, JITUserContext* user);

}  // namespace retrograde::frontend
