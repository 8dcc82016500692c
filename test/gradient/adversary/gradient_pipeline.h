// Builds one pipeline from a random program and all of its gradients.
#pragma once

#include <cstdint>
#include <vector>

#include "frontend/data/realization.h"
#include "frontend/run/pipeline.h"
#include "gradient/adversary/probe.h"

namespace retrograde::gradient {

using Buffers = std::vector<Buffer<>>;

// How the region of the program's output is specified.
enum class Extents : uint8_t {
  Constant,
  One,         // one element in each dimension
  Parameters,  // known when the pipeline runs
  Huge,        // too many elements along the last dimension to run: compiled only
  Estimated    // parameters, with estimates that are wrong
};

class GradientPipeline {
 public:
  // The program must outlive it.
  GradientPipeline(const AdversaryProgram& program, Extents extents);

  // A new copy of all Funcs, without directives.
  Pipeline copy() const;
  // The scheduled copy again, with its Funcs at root in serial loops, except those that it inlines.
  Pipeline in_serial_loops_like(const std::vector<graph::FuncPtr>& scheduled) const;
  Pipeline own() const { return Pipeline(outputs_); }

  const std::vector<Func>& outputs() const { return outputs_; }
  const std::vector<oracle::Region>& regions() const { return regions_; }
  // Runs the pipeline into buffers filled with garbage.
  Buffers realize(Pipeline pipeline, JITUserContext* context) const;
  // The size of the largest Func of the program whose size is known; below, the size of inputs and outputs.
  int64_t largest_bytes() const;
  int64_t callers_bytes() const;

 private:
  Region bounds(const oracle::Region& region) const;
  void add(const Func& f, const oracle::Region& region);
  std::vector<OutputAdjoint> seeded_outputs();
  Buffer<float> seed(int number, const oracle::Region& region) const;

  const AdversaryProgram& p_;
  const Extents extents_;
  std::vector<Buffer<float>> seeds_;
  std::vector<Func> outputs_;
  std::vector<oracle::Region> regions_;
};

}  // namespace retrograde::gradient
