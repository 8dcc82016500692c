// callable.cpp -- maps arguments from the caller's order to the order of compiled code.
#include "frontend/run/callable.h"

#include "frontend/run/call.h"
#include "frontend/run/pipeline.h"
#include "ir/print.h"

namespace retrograde {

namespace {

using ParameterPtr = std::shared_ptr<graph::ParameterContents>;

// One argument of the function, and its position in the arguments of compiled code.
struct Place {
  std::string name;
  Type type;
  int dimensions = 0;
  bool is_buffer = false, is_output = false;
  size_t position = 0;
  ParameterPtr parameter;  // null for an output
};

ParameterPtr parameter_of(const ir::LoweredArgument& arg) {
  return std::dynamic_pointer_cast<graph::ParameterContents>(arg.symbol.lock());
}

Place place_of(const ir::LoweredArgument& arg, size_t position) {
  return {arg.name,
          arg.type,
          arg.dimensions,
          arg.is_buffer(),
          arg.kind == ir::LoweredArgument::Kind::OutputBuffer,
          position,
          parameter_of(arg)};
}

}  // namespace

struct Callable::Contents {
  std::string name;
  std::shared_ptr<CompiledPipeline> code;
  JITHandlers handlers;
  std::vector<Place> places;    // one for each argument, in the caller's order
  std::vector<Place> literals;  // Buffers embedded in the program
  std::string asked;            // begins every message
};

// An argument that the outputs do not need is accepted and ignored; all others are arguments of the code.
Callable Pipeline::callable(const std::vector<Argument>& args, const Target& target) {
  auto contents = std::make_shared<Callable::Contents>();
  contents->name = spec().name;
  contents->asked = "call " + quoted(contents->name);
  contents->code = compiled(target);
  contents->handlers = jit_handlers();
  const std::vector<ir::LoweredArgument>& lowered = contents->code->arguments();
  std::vector<bool> is_given(lowered.size(), false);
  for (const Argument& arg : args) {
    Place place{arg.name, arg.type, arg.dimensions, arg.is_buffer(), false, lowered.size(), {}};
    for (size_t i = 0; i < lowered.size(); i++) {
      if (lowered[i].name != arg.name) continue;
      place = place_of(lowered[i], i);
      is_given[i] = true;
    }
    contents->places.push_back(place);
  }
  for (size_t i = 0; i < lowered.size(); i++) {
    const Place place = place_of(lowered[i], i);
    if (is_given[i]) continue;
    if (place.is_output) {
      contents->places.push_back(place);
    } else if (place.parameter && place.parameter->is_literal) {
      contents->literals.push_back(place);
    } else {
      user_error("compile " + quoted(contents->name) + " to a Callable",
                 "its arguments are all that the outputs need",
                 quoted(place.name) + " is not among them", "Add it to the list");
    }
  }
  return Callable(contents);
}

void Callable::check(const std::vector<Value>& values) const {
  if (!defined())
    user_error("call a Callable", "only what was compiled can be called",
               "it was constructed without a pipeline", "Get it from compile_to_callable()");
  const std::string& asked = contents_->asked;
  const std::vector<Place>& places = contents_->places;
  if (values.size() != places.size()) {
    call_error(asked, "it takes its arguments, then its output buffers",
               text("there are ", places.size(), " and ", values.size(), " were given"),
               "Give that many");
  }
  for (size_t i = 0; i < values.size(); i++) {
    const Place& place = places[i];
    const auto what = [&] { return text("argument ", i + 1, ", ", quoted(place.name), ","); };
    if (values[i].is_buffer != place.is_buffer) {
      call_error(asked, what() + (place.is_buffer ? " must be a buffer" : " must be a scalar"),
                 place.is_buffer ? "a scalar was given" : "a buffer was given",
                 place.is_buffer ? "Give a Buffer" : "Give a number");
    }
    if (values[i].type.bits() > 0 && values[i].type != place.type) {
      call_error(asked, text(what(), " must be of type ", to_string(place.type)),
                 to_string(values[i].type) + " was given", "Give a value of that type");
    }
    if (values[i].dimensions >= 0 && values[i].dimensions != place.dimensions) {
      call_error(asked, what() + " must have the dimensions that it was compiled for",
                 text("they are ", place.dimensions, ", and a buffer of ", values[i].dimensions,
                      " was given"),
                 "Give a buffer of that many dimensions");
    }
  }
}

int Callable::call(JITUserContext* context, const std::vector<Value>& values) const {
  const JITHandlers& handlers = contents_ ? contents_->handlers : JITHandlers();
  const int refused = frontend::prepared(handlers, context, [&] { check(values); });
  if (refused != 0) return refused;
  const std::string& asked = contents_->asked;
  std::vector<void*> argv(contents_->code->arguments().size() +
                          1);  // one more, for unused arguments
  std::vector<uint64_t> scalars(values.size());
  const int unfit = frontend::prepared(handlers, context, [&] { bind(values, argv, scalars); });
  if (unfit != 0) return unfit;
  for (const Place& literal : contents_->literals)
    argv[literal.position] = literal.parameter->buffer;
  return frontend::call(*contents_->code, handlers, argv.data(), asked, context);
}

void Callable::bind(const std::vector<Value>& values, std::vector<void*>& argv,
                    std::vector<uint64_t>& scalars) const {
  const std::string& asked = contents_->asked;
  for (size_t i = 0; i < values.size(); i++) {
    const Place& place = contents_->places[i];
    if (place.is_buffer) {
      frontend::check_buffer(values[i].buffer, place.name, place.type, place.dimensions, false,
                             asked);
      argv[place.position] = values[i].buffer;
      continue;
    }
    if (place.parameter) frontend::check_limits(*place.parameter, values[i].scalar, asked);
    scalars[i] = frontend::scalar_bits(values[i].scalar);
    argv[place.position] = &scalars[i];
  }
}

}  // namespace retrograde
