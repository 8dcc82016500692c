// Entry points of ahead-of-time compiled functions, exactly as HalideRuntime.h specifies them.
//
//   int name([void *user_context,] arguments...)    buffers as halide_buffer_t *, scalars by value
//   int name_argv(void **arguments)                  as the generated function's argv: pointers
//   const halide_filter_metadata_t *name_metadata()
//
// The lowered function becomes internal; its entry point creates the call's context (retrograde_begin_call) and passes
// on the arguments.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ir/scalar.h"
#include "ir/type.h"

struct halide_buffer_t;

namespace retrograde::codegen {

struct ExportArgument {
  enum class Kind : uint8_t { Scalar = 0, InputBuffer = 1, OutputBuffer = 2 };
  std::string name;  // as metadata shows it
  Kind kind = Kind::Scalar;
  Type type;
  int dimensions = 0;
  std::optional<ir::Scalar> def, min, max, estimate;
  std::vector<std::pair<int64_t, int64_t>> buffer_estimates;  // min, extent; empty: none
  bool is_buffer() const { return kind != Kind::Scalar; }
};

struct Signature {
  std::string name, argv_name, metadata_name;  // symbols; an empty one is left out
  std::string metadata_title;                  // the function's name in metadata
  std::string target;                          // as metadata shows it
  bool user_context = false;                   // the first of `arguments`
  std::vector<ExportArgument> arguments;
};

// Where an argument of the lowered function comes from: the caller, or data embedded in the code.
struct Source {
  int argument = -1;                          // of the signature
  const halide_buffer_t* embedded = nullptr;  // its contents are copied into the code
};

struct Export {
  Signature signature;
  size_t function = 0;          // index into the program's functions
  std::vector<Source> sources;  // one for each argument of the lowered function
};

// A function that calls the first variant whose features the processor has. The last variant is the fallback.
struct Dispatch {
  struct Variant {
    std::string name;
    std::vector<uint64_t> features;  // bits at the positions of halide_target_feature_t
  };
  Signature signature;
  std::vector<Variant> variants;
};

}  // namespace retrograde::codegen
