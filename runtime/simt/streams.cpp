// Streams: operations run only when something waits for them. Their order is then random, within the constraints of
// streams, the default stream and events.
#include <algorithm>
#include <random>

#include "simt/state.h"

namespace retrograde::simt {
namespace {

std::mt19937_64& chance() {
  static std::mt19937_64 engine(options().seed);
  return engine;
}

bool is_ready(const Operation& operation) {
  return std::all_of(operation.after.begin(), operation.after.end(),
                     [](const OperationPtr& before) { return before->is_done; });
}

bool are_done(const std::vector<OperationPtr>& wanted) {
  return std::all_of(wanted.begin(), wanted.end(),
                     [](const OperationPtr& one) { return !one || one->is_done; });
}

// Chooses among ready operations: the first that was enqueued, or a random one.
size_t choose(const std::vector<OperationPtr>& pending) {
  std::vector<size_t> ready;
  for (size_t i = 0; i < pending.size(); i++) {
    if (is_ready(*pending[i])) ready.push_back(i);
  }
  return options().in_order ? ready.front() : ready[chance()() % ready.size()];
}

void add_last(Operation& operation, const StreamState& stream) {
  if (stream.last && !stream.last->is_done) operation.after.push_back(stream.last);
}

// The default stream waits for all blocking streams, and they wait for it.
void add_order(Operation& operation, StreamState& stream) {
  ContextState& context = *stream.context;
  add_last(operation, stream);
  if (&stream == &context.default_stream) {
    for (const auto& other : context.streams) {
      if (other->is_blocking) add_last(operation, *other);
    }
  } else if (stream.is_blocking) {
    add_last(operation, context.default_stream);
  }
}

// Drops operations that have not run: a lost context runs nothing any more.
Result lose(ContextState& context, Result result) {
  context.lost = result;
  for (const OperationPtr& operation : context.pending) operation->is_done = true;
  context.pending.clear();
  return result;
}

template <typename F>
void for_each_capture(F f) {
  for (const auto& context : state().contexts) {
    for (const auto& stream : context->streams) {
      if (stream->capture) f(*stream);
    }
  }
}

}  // namespace

StreamState* find_stream(ContextState& context, Stream stream) {
  return stream ? find_in(context.streams, stream) : &context.default_stream;
}

Result enqueue(StreamState& stream, std::function<Result()> run) {
  if (stream.capture) {
    if (stream.is_invalidated) return capture_invalidated;
    stream.capture->nodes.push_back(std::move(run));
    return success;
  }
  auto operation = std::make_shared<Operation>();
  operation->run = std::move(run);
  add_order(*operation, stream);
  stream.context->pending.push_back(operation);
  stream.last = std::move(operation);
  return success;
}

Result complete(ContextState& context, const std::vector<OperationPtr>& wanted) {
  if (context.lost != success) return context.lost;
  while (!are_done(wanted)) {
    const size_t next = choose(context.pending);
    const OperationPtr operation = context.pending[next];
    context.pending.erase(context.pending.begin() + static_cast<std::ptrdiff_t>(next));
    const Result result = operation->run();
    operation->is_done = true;
    operation->after.clear();
    if (result != success) return lose(context, result);
  }
  return success;
}

Result complete_all(ContextState& context) {
  return complete(context, std::vector<OperationPtr>(context.pending));
}

Result complete_stream(StreamState& stream) {
  std::vector<OperationPtr> wanted = {stream.last};
  if (&stream == &stream.context->default_stream) {
    for (const auto& other : stream.context->streams) {
      if (other->is_blocking) wanted.push_back(other->last);
    }
  }
  return complete(*stream.context, wanted);
}

Result refuse_in_capture() {
  Result result = success;
  const int mode = capture_mode_of_this_thread();
  if (mode == capture_mode_relaxed) return result;
  for_each_capture([&](StreamState& stream) {
    if (stream.capture_mode == capture_mode_relaxed) return;
    const bool is_own = stream.capture_thread == this_thread();
    const bool is_global =
        stream.capture_mode == capture_mode_global && mode == capture_mode_global;
    if (!is_own && !is_global) return;
    stream.is_invalidated = true;
    result = capture_unsupported;
  });
  return result;
}

Result refuse_on(StreamState& stream) {
  if (stream.capture) {
    stream.is_invalidated = true;
    return capture_unsupported;
  }
  if (&stream != &stream.context->default_stream) return success;
  // Reject, because the default stream would wait for the captured one.
  Result result = success;
  for_each_capture([&](StreamState& other) {
    if (other.context != stream.context || !other.is_blocking) return;
    other.is_invalidated = true;
    result = capture_implicit;
  });
  return result;
}

}  // namespace retrograde::simt
