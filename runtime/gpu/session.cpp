// Sessions: make the caller's CUDA context current.
#include "gpu/session.h"

#include "gpu/host.h"

namespace retrograde::runtime {
namespace {

const retrograde_gpu_handlers& handlers_of(const Request& request) {
  static constexpr retrograde_gpu_handlers none = {};
  const retrograde_context* caller = request.caller;
  return caller && caller->gpu_handlers ? *caller->gpu_handlers : none;
}

int32_t handler_failed(const Request& request, const char* handler, int32_t code) {
  return request.refuse("the caller's handlers must give 0",
                        Line("%s gave %i", handler, int64_t{code}),
                        "See what the handler has to say");
}

}  // namespace

int32_t default_context(const Request& request, const Driver& driver, Context current,
                        Context& context) {
  const int number = host().selected_device(request.caller);
  context = current;
  return number == -1 && current ? 0 : primary_context(request, driver, number, context);
}

int32_t Session::open() {
  driver_ = open_driver(request);
  if (!driver_) return request.code;
  if (const Result result = driver_->cuCtxGetCurrent(&before_); result != success)
    return failed("cuCtxGetCurrent", result);
  Context context = nullptr;
  if (const int32_t code = acquire(context)) return code;
  if (const int32_t code = enter(context)) return code;
  return get_stream();
}

int32_t Session::open(Context context) {
  driver_ = open_driver(request);
  if (!driver_) return request.code;
  if (const Result result = driver_->cuCtxGetCurrent(&before_); result != success)
    return failed("cuCtxGetCurrent", result);
  return enter(context);
}

int32_t Session::acquire(Context& context) {
  const retrograde_gpu_handlers& handlers = handlers_of(request);
  if (!handlers.acquire_context) return default_context(request, *driver_, before_, context);
  if (const int32_t code = handlers.acquire_context(request.caller, &context, 1))
    return handler_failed(request, "acquire_context", code);
  is_acquired_ = true;
  if (context) return 0;
  return request.refuse("the caller's handler must give a context", "acquire_context gave null",
                        "Leave the handler out for the device's primary context");
}

int32_t Session::enter(Context context) {
  if (context != before_) {
    if (const Result result = driver_->cuCtxSetCurrent(context); result != success)
      return failed("cuCtxSetCurrent", result);
    is_changed_ = true;
  }
  return state_of_context(request, *driver_, context, device_);
}

int32_t Session::get_stream() {
  const retrograde_gpu_handlers& handlers = handlers_of(request);
  if (!handlers.get_stream) return 0;
  const int32_t code = handlers.get_stream(request.caller, device_->context, &stream_);
  return code == 0 ? 0 : handler_failed(request, "get_stream", code);
}

// Tries twice: a thread left in another context would use the wrong device from then on.
int32_t Session::restore() {
  int32_t code = 0;
  if (is_changed_) {
    const Result result = driver_->cuCtxSetCurrent(before_);
    if (result != success) {
      code = failed("cuCtxSetCurrent", result);
      driver_->cuCtxSetCurrent(before_);
    }
    is_changed_ = false;
  }
  if (is_acquired_) {
    is_acquired_ = false;
    const retrograde_gpu_handlers& handlers = handlers_of(request);
    const int32_t given = handlers.release_context ? handlers.release_context(request.caller) : 0;
    if (given != 0 && code == 0) code = handler_failed(request, "release_context", given);
  }
  return code;
}

int32_t Session::close(int32_t code) {
  const int32_t restored = restore();
  return code != 0 ? code : restored;
}

int32_t Session::capture(uint64_t& id) const {
  id = 0;
  if (!stream_) return 0;  // the default stream cannot be captured
  int status = capture_none;
  uint64_t given = 0;
  const Result result =
      driver_->cuStreamGetCaptureInfo_v2(stream_, &status, &given, nullptr, nullptr, nullptr);
  if (result != success) return failed("cuStreamGetCaptureInfo_v2", result);
  if (status != capture_none) id = given;
  return 0;
}

int32_t Session::wait() const {
  const Result result = driver_->cuStreamSynchronize(stream_);
  return result == success ? 0 : failed("cuStreamSynchronize", result);
}

}  // namespace retrograde::runtime
