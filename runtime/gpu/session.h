// The device and stream of one call. While a session is open, its CUDA context is the thread's current one; closing it
// restores the previous context.
#pragma once

#include "gpu/devices.h"

namespace retrograde::runtime {

class Session {
 public:
  explicit Session(const Request& request) : request(request) {}
  ~Session() { restore(); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // Opens the context and stream of the caller's handlers and settings, or the given context with its default stream.
  int32_t open();
  int32_t open(Context context);
  // Returns `code`, or if that is 0, any error of restoring the context. An open session must be closed, or its errors
  // are lost.
  int32_t close(int32_t code);

  const Driver& driver() const { return *driver_; }
  DeviceState& device() const { return *device_; }
  Stream stream() const { return stream_; }
  // The number of the graph that the stream is being captured into; 0: none.
  int32_t capture(uint64_t& id) const;
  // Waits for all work on the stream.
  int32_t wait() const;
  int32_t failed(const char* function, Result result, const char* evidence = "") const {
    return request.driver_failed(*driver_, function, result, evidence);
  }

  const Request& request;

 private:
  int32_t acquire(Context& context);
  int32_t enter(Context context);
  int32_t get_stream();
  int32_t restore();

  const Driver* driver_ = nullptr;
  DeviceState* device_ = nullptr;
  Stream stream_ = nullptr;
  Context before_ = nullptr;
  bool is_changed_ = false, is_acquired_ = false;
};

// The context of a call whose caller names none: that of the selected device; else `current` unless it is null; else
// the primary context of the last device.
int32_t default_context(const Request&, const Driver&, Context current, Context&);

}  // namespace retrograde::runtime
