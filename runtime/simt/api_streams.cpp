// The simulated driver's functions for streams, events and graphs. A capture is of one stream: work that another stream
// would join by events is rejected.
#include <utility>

#include "simt/call.h"

using namespace retrograde::simt;

RETROGRADE_SIMT_EXPORT Result cuStreamCreate(Stream* stream, unsigned flags) {
  return call_in_context("cuStreamCreate", [&](ContextState& context) -> Result {
    auto made = std::make_unique<StreamState>();
    made->context = &context;
    made->is_blocking = (flags & 1) == 0;
    *stream = made.get();
    context.streams.insert(std::move(made));
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuStreamDestroy_v2(Stream handle) {
  return call_in_context("cuStreamDestroy_v2", [&](ContextState& context) -> Result {
    return erase_from(context.streams, handle) ? success : invalid_handle;
  });
}

RETROGRADE_SIMT_EXPORT Result cuStreamSynchronize(Stream handle) {
  return call_on_stream("cuStreamSynchronize", handle, [](StreamState& stream) -> Result {
    if (const Result refused = refuse_on(stream); refused != success) return refused;
    if (const Result refused = refuse_in_capture(); refused != success) return refused;
    return complete_stream(stream);
  });
}

RETROGRADE_SIMT_EXPORT Result cuStreamQuery(Stream handle) {
  return call_on_stream("cuStreamQuery", handle, [](StreamState& stream) -> Result {
    if (const Result refused = refuse_on(stream); refused != success) return refused;
    return stream.last && !stream.last->is_done ? not_ready : success;
  });
}

// ---- events ----

RETROGRADE_SIMT_EXPORT Result cuEventCreate(Event* event, unsigned) {
  return call_in_context("cuEventCreate", [&](ContextState&) -> Result {
    auto made = std::make_unique<EventState>();
    *event = made.get();
    state().events.insert(std::move(made));
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuEventDestroy_v2(Event event) {
  return call_in_context("cuEventDestroy_v2", [&](ContextState&) -> Result {
    return erase_from(state().events, event) ? success : invalid_handle;
  });
}

RETROGRADE_SIMT_EXPORT Result cuEventRecord(Event handle, Stream stream_handle) {
  return call_on_stream("cuEventRecord", stream_handle, [&](StreamState& stream) -> Result {
    EventState* event = find_in(state().events, handle);
    if (!event) return invalid_handle;
    if (const Result refused = refuse_on(stream); refused != success) return refused;
    event->last = stream.last;
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuStreamWaitEvent(Stream stream_handle, Event handle, unsigned) {
  return call_on_stream("cuStreamWaitEvent", stream_handle, [&](StreamState& stream) -> Result {
    EventState* event = find_in(state().events, handle);
    if (!event) return invalid_handle;
    if (const Result refused = refuse_on(stream); refused != success) return refused;
    const Result result = enqueue(stream, []() -> Result { return success; });
    if (result == success && event->last) stream.last->after.push_back(event->last);
    return result;
  });
}

RETROGRADE_SIMT_EXPORT Result cuEventSynchronize(Event handle) {
  return call_in_context("cuEventSynchronize", [&](ContextState& context) -> Result {
    EventState* event = find_in(state().events, handle);
    if (!event) return invalid_handle;
    if (const Result refused = refuse_in_capture(); refused != success) return refused;
    return complete(context, {event->last});
  });
}

// ---- graphs ----

RETROGRADE_SIMT_EXPORT Result cuStreamBeginCapture_v2(Stream handle, int mode) {
  return call_on_stream("cuStreamBeginCapture_v2", handle, [&](StreamState& stream) -> Result {
    if (!handle) return capture_unsupported;
    if (stream.capture) return illegal_state;
    if (mode < 0 || mode > 2) return invalid_value;
    stream.capture = std::make_unique<GraphState>();
    stream.capture_id = ++state().captures;
    stream.capture_mode = mode;
    stream.capture_thread = this_thread();
    stream.is_invalidated = false;
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuStreamEndCapture(Stream handle, Graph* graph) {
  return call_on_stream("cuStreamEndCapture", handle, [&](StreamState& stream) -> Result {
    *graph = nullptr;
    if (!stream.capture) return illegal_state;
    auto captured = std::move(stream.capture);
    if (stream.is_invalidated) return capture_invalidated;
    *graph = captured.get();
    state().graphs.insert(std::move(captured));
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuStreamGetCaptureInfo_v2(Stream handle, int* status, uint64_t* id,
                                                        Graph* graph, const void** dependencies,
                                                        size_t* count) {
  return call_on_stream("cuStreamGetCaptureInfo_v2", handle, [&](StreamState& stream) -> Result {
    *status = !stream.capture         ? capture_none
              : stream.is_invalidated ? capture_is_invalidated
                                      : capture_active;
    if (id) *id = stream.capture_id;
    if (graph) *graph = stream.capture.get();
    if (dependencies) *dependencies = nullptr;
    if (count) *count = 0;
    return success;
  });
}

// The modes of threads and captures together decide which calls are allowed: see refuse_in_capture().
RETROGRADE_SIMT_EXPORT Result cuThreadExchangeStreamCaptureMode(int* mode) {
  return call("cuThreadExchangeStreamCaptureMode", [&]() -> Result {
    if (*mode < capture_mode_global || *mode > capture_mode_relaxed) return invalid_value;
    std::swap(*mode, capture_mode_of_this_thread());
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuStreamIsCapturing(Stream handle, int* status) {
  return call_on_stream("cuStreamIsCapturing", handle, [&](StreamState& stream) -> Result {
    *status = !stream.capture         ? capture_none
              : stream.is_invalidated ? capture_is_invalidated
                                      : capture_active;
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuGraphInstantiateWithFlags(GraphExec* out, Graph handle, uint64_t) {
  return call_in_context("cuGraphInstantiateWithFlags", [&](ContextState&) -> Result {
    const GraphState* graph = find_in(state().graphs, handle);
    if (!graph) return invalid_value;
    auto copy = std::make_unique<GraphState>(*graph);
    *out = copy.get();
    state().graphs.insert(std::move(copy));
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuGraphLaunch(GraphExec handle, Stream stream_handle) {
  return call_on_stream("cuGraphLaunch", stream_handle, [&](StreamState& stream) -> Result {
    const GraphState* graph = find_in(state().graphs, handle);
    if (!graph) return invalid_value;
    for (const auto& node : graph->nodes) {
      if (const Result result = enqueue(stream, node); result != success) return result;
    }
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuGraphDestroy(Graph graph) {
  return call("cuGraphDestroy", [&]() -> Result {
    return erase_from(state().graphs, graph) ? success : invalid_value;
  });
}

RETROGRADE_SIMT_EXPORT Result cuGraphExecDestroy(GraphExec graph) {
  return call("cuGraphExecDestroy", [&]() -> Result {
    return erase_from(state().graphs, graph) ? success : invalid_value;
  });
}
