// The device and stream of one call: its CUDA context is the thread's current one while a session is
// open, and what was current before is so again afterwards.
#pragma once

#include "gpu/devices.h"

namespace retrograde::runtime {

class Session {
 public:
  explicit Session(const Request& request) : request(request) {}
  ~Session() { restore(); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // By the caller's handlers and settings, or of the given context, with its default stream.
  int32_t open();
  int32_t open(Context context);
  // Gives `code`, or where that is 0, what went wrong in restoring. An open session must be closed for
  // its errors to be seen.
  int32_t close(int32_t code);

  const Driver& driver() const { return *driver_; }
  DeviceState& device() const { return *device_; }
  Stream stream() const { return stream_; }
  // The number of the graph that the stream is being captured for; 0: none.
  int32_t capture(uint64_t& id) const;
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

// The context of a call whose caller names none: that of the wanted device; else `current`, unless it is
// null; else the primary one of the last device.
int32_t default_context(const Request&, const Driver&, Context current, Context&);

}  // namespace retrograde::runtime
