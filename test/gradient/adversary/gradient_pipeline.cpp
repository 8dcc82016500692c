#include "gradient/adversary/gradient_pipeline.h"

#include <algorithm>
#include <cstring>

#include "graph/copy_graph.h"
#include "transform/size_estimate.h"

namespace retrograde::gradient {

namespace {

constexpr int huge = 1 << 20;  // times as large along the last dimension

std::vector<graph::FuncPtr> contents_of(const std::vector<Func>& funcs) {
  std::vector<graph::FuncPtr> result;
  for (const Func& f : funcs) result.push_back(f.function());
  return result;
}

Param<int> parameter(const Expr& value, int estimate_factor) {
  Param<int> result;
  const auto constant = static_cast<int>(*ir::as_const_int(value));
  result.set(constant);
  if (estimate_factor > 0) result.set_estimate(std::max(constant * estimate_factor, 1));
  return result;
}

}  // namespace

GradientPipeline::GradientPipeline(const AdversaryProgram& program, Extents extents)
    : p_(program), extents_(extents) {
  std::vector<AdjointInput> by;
  for (size_t i = 0; i < p_.images.size(); ++i) by.push_back(p_.image(i));
  by.push_back(p_.scale);
  AdjointOptions options = p_.options;
  options.wrt = by;
  const Derivative d = propagate_adjoints(seeded_outputs(), options);
  for (size_t o = 0; o < p_.outputs.size(); ++o) add(p_.outputs[o], p_.runs.front()[o]);
  for (size_t i = 0; i < by.size(); ++i) {
    const Func gradient = d.of(by[i]);
    if (gradient.defined())
      add(gradient,
          i < p_.images.size() ? oracle::region_of(*p_.images[i].raw_buffer()) : oracle::Region{});
  }
}

std::vector<OutputAdjoint> GradientPipeline::seeded_outputs() {
  std::vector<OutputAdjoint> result;
  for (size_t o = 0; o < p_.outputs.size(); ++o) {
    const oracle::Region& region = p_.runs.front()[o];
    std::vector<Buffer<float>> seeds;
    for (int k = 0; k < p_.outputs[o].outputs(); ++k)
      seeds.push_back(seed(static_cast<int>(seeds_.size()) + k, region));
    seeds_.insert(seeds_.end(), seeds.begin(), seeds.end());
    result.push_back({p_.outputs[o], reading(seeds, "w"), bounds(region)});
  }
  return result;
}

// Values from -1 to 1, in a pattern that no program contains.
Buffer<float> GradientPipeline::seed(int number, const oracle::Region& region) const {
  Buffer<float> result(region.extents, "w" + std::to_string(number));
  result.set_min(region.mins);
  auto state = static_cast<uint32_t>(number + 1) * 2654435761u;
  for (size_t i = 0; i < result.number_of_elements(); ++i) {
    state = state * 1664525u + 1013904223u;
    result.data()[i] = static_cast<float>(static_cast<int32_t>(state) >> 8) * 0x1p-23f;
  }
  return result;
}

Region GradientPipeline::bounds(const oracle::Region& region) const {
  Region result;
  const bool is_known_late = extents_ == Extents::Parameters || extents_ == Extents::Estimated;
  for (size_t d = 0; d < region.mins.size(); ++d) {
    Range side{Expr(region.mins[d]), Expr(region.extents[d])};
    const int factor = extents_ == Extents::Estimated ? 2 : 0;
    if (is_known_late) side = {parameter(side.min, factor), parameter(side.extent, factor)};
    result.push_back(side);
  }
  if (extents_ == Extents::Huge && !result.empty())
    result.back().extent = result.back().extent * huge;
  return result;
}

void GradientPipeline::add(const Func& f, const oracle::Region& region) {
  for (const Func& other : outputs_) {
    if (other.function() == f.function()) return;
  }
  outputs_.push_back(f);
  regions_.push_back(region);
}

Pipeline GradientPipeline::copy() const {
  std::vector<Func> result;
  for (const graph::FuncPtr& f : graph::copy_graph(contents_of(outputs_)).outputs)
    result.emplace_back(f);
  return Pipeline(result);
}

Pipeline GradientPipeline::in_serial_loops_like(
    const std::vector<graph::FuncPtr>& scheduled) const {
  const Pipeline serial = copy();
  const auto funcs = graph::topological_order(contents_of(serial.outputs()));
  for (size_t i = 0; i < funcs.size(); ++i) {
    if (scheduled[i]->schedule.compute_level.kind != graph::LoopLevel::Kind::Inlined)
      Func(funcs[i]).compute_root();
  }
  return serial;
}

Buffers GradientPipeline::realize(Pipeline pipeline, JITUserContext* context) const {
  Buffers results;
  for (size_t i = 0; i < outputs_.size(); ++i) {
    for (const Type& type : outputs_[i].types()) {
      results.push_back(room_for(type, regions_[i]));
      std::memset(results.back().data(), 0x7f, results.back().size_in_bytes());
    }
  }
  pipeline.realize(context, Realization(results));
  return results;
}

int64_t GradientPipeline::largest_bytes() const {
  const std::vector<graph::FuncPtr> primal = graph::copy_graph(contents_of(p_.outputs)).outputs;
  for (size_t o = 0; o < primal.size(); ++o) {
    Func output(primal[o]);
    const oracle::Region& region = p_.runs.front()[o];
    for (size_t d = 0; d < region.mins.size(); ++d)
      output.set_estimate(output.args()[d], region.mins[d], region.extents[d]);
  }
  const transform::SizeEstimate sizes(primal);
  int64_t largest = 0;
  for (const graph::FuncPtr& f : graph::topological_order(primal))
    largest = std::max(largest, sizes.bytes(*f));
  return largest;
}

int64_t GradientPipeline::callers_bytes() const {
  int64_t bytes = 0;
  for (const Buffer<>& image : p_.images) bytes += static_cast<int64_t>(image.size_in_bytes());
  for (const Buffer<float>& each : seeds_) bytes += static_cast<int64_t>(each.size_in_bytes());
  for (size_t i = 0; i < outputs_.size(); ++i) {
    for (const Type& type : outputs_[i].types())
      bytes += static_cast<int64_t>(regions_[i].points()) * type.bytes();
  }
  return bytes;
}

}  // namespace retrograde::gradient
