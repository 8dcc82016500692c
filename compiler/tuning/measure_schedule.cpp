#include "tuning/measure_schedule.h"

#include <HalideRuntime.h>

#include <chrono>
#include <limits>
#include <memory>
#include <random>

#include "frontend/run/call.h"
#include "graph/definitions/parameter_contents.h"
#include "jit/jit.h"
#include "lower/lower.h"
#include "tuning/compiled_once.h"
#include "tuning/program_sizes.h"

namespace retrograde::tuning {

namespace {

constexpr int fewest_timed_runs = 3;
constexpr const char* asked_of_schedule = "measure a schedule";

Buffer<> buffer_of(Type type, const BufferShape& shape) {
  std::vector<int> sizes;
  for (const BufferShape::Dim& dim : shape.dims) sizes.push_back(static_cast<int>(dim.extent));
  Buffer<> result(type, sizes);
  for (size_t d = 0; d < sizes.size(); d++)
    result.raw_buffer()->dim[d].min = static_cast<int>(shape.dims[d].min);
  return result;
}

template <typename T>
void fill_as(Buffer<>& buffer, std::minstd_rand& random) {
  T* values = reinterpret_cast<T*>(buffer.raw_buffer()->host);
  const size_t count = buffer.number_of_elements();
  for (size_t i = 0; i < count; i++) {
    const auto number = static_cast<uint32_t>(random());
    if constexpr (std::is_floating_point_v<T>)
      values[i] = static_cast<T>(number >> 8 & 0xffff) / T(0x10000);
    else
      values[i] = static_cast<T>(number >> 8 & (sizeof(T) == 1 ? 0x7f : 0xff));
  }
}

// Of other types: zeros.
void fill(Buffer<>& buffer, Type type, std::minstd_rand& random) {
  const bool is_bool = type.is_uint() && type.bits() == 1;
  if (type == Float(32)) return fill_as<float>(buffer, random);
  if (type == Float(64)) return fill_as<double>(buffer, random);
  if (type.is_float() || is_bool || !(type.is_int() || type.is_uint())) {
    std::fill_n(buffer.raw_buffer()->host,
                buffer.number_of_elements() * static_cast<size_t>(type.bytes()), uint8_t{0});
  } else if (type.bits() == 8) {
    fill_as<uint8_t>(buffer, random);
  } else if (type.bits() == 16) {
    fill_as<uint16_t>(buffer, random);
  } else if (type.bits() == 32) {
    fill_as<uint32_t>(buffer, random);
  } else {
    fill_as<uint64_t>(buffer, random);
  }
}

Scalar scalar_of(Type type, double value) {
  if (type.is_float()) return ir::Scalar::of_float(type, value);
  const auto whole = static_cast<int64_t>(value);
  return type.is_int() ? ir::Scalar::of_int(type, whole)
                       : ir::Scalar::of_uint(type, static_cast<uint64_t>(whole));
}

ir::LoweredFunction lowered(const std::vector<FuncPtr>& outputs, const Target& target) {
  lower::LowerOptions options;
  options.target = target;
  return lower::lower("measured", outputs, lower::infer_arguments(outputs), options);
}

}  // namespace

void bind_sample_inputs(const std::vector<FuncPtr>& outputs) {
  std::minstd_rand random(1);
  ir::LoweredFunction function;
  function.args = lower::infer_arguments(outputs);
  const ProgramSizes sizes = program_sizes(function, output_shapes(outputs));
  for (const auto& p : graph::parameters_of(outputs)) {
    if (p->is_buffer && !p->buffer) {
      auto buffer = std::make_shared<Buffer<>>(buffer_of(p->type, sizes.buffers.at(p->name)));
      fill(*buffer, p->type, random);
      p->buffer = buffer->raw_buffer();
      p->buffer_owner = buffer;
    } else if (!p->is_buffer && !p->value) {
      p->value = scalar_of(p->type, sizes.scalars.at(p->name));
    }
  }
}

std::vector<Buffer<>> sample_outputs(const std::vector<FuncPtr>& outputs) {
  std::vector<Buffer<>> result;
  const std::vector<BufferShape> shapes = output_shapes(outputs);
  for (const FuncPtr& f : outputs) {
    for (const Type& type : f->types) result.push_back(buffer_of(type, shapes[result.size()]));
  }
  return result;
}

struct CompiledSchedule::Call {
  CompiledOnce code;
  std::vector<Buffer<>> outputs;
  JITHandlers handlers;
  std::unique_ptr<frontend::Arguments> arguments;
};

CompiledSchedule::CompiledSchedule(const std::vector<FuncPtr>& scheduled, const Target& target,
                                   int threads)
    : call_(std::make_unique<Call>(Call{CompiledOnce(lowered(scheduled, target), target, {}),
                                        sample_outputs(scheduled),
                                        {},
                                        nullptr})) {
  std::vector<halide_buffer_t*> raw;
  for (Buffer<>& buffer : call_->outputs) raw.push_back(buffer.raw_buffer());
  call_->arguments = std::make_unique<frontend::Arguments>(
      call_->code, raw, false, asked_of_schedule, ParamMap::empty_map());
  if (threads > 0) call_->handlers.thread_limit = threads;
}

CompiledSchedule::~CompiledSchedule() = default;

double CompiledSchedule::run() const {
  const auto begin = std::chrono::steady_clock::now();
  frontend::call(call_->code, call_->handlers, call_->arguments->argv(), asked_of_schedule,
                 nullptr);
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
  return spent.count();
}

MeasuredSchedule measure_schedule(const std::vector<FuncPtr>& scheduled, const Target& target,
                                  const MeasureOptions& options) {
  const CompiledSchedule compiled(scheduled, target, options.threads);
  MeasuredSchedule result{std::numeric_limits<double>::infinity(), 0};
  double spent = 0;
  while (result.runs < fewest_timed_runs || spent < options.seconds) {
    const double seconds = compiled.run();
    result.runs++;
    spent += seconds;
    result.seconds = std::min(result.seconds, seconds);
    if (options.hopeless_seconds > 0 && result.seconds > options.hopeless_seconds) break;
  }
  return result;
}

}  // namespace retrograde::tuning
