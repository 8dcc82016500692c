// Declares the simulated driver's functions for tests that link it: those that the runtime calls, and a few that
// programs call.
#pragma once

#include "gpu/driver_types.h"
#include "simt/simt_driver.h"

namespace retrograde::cuda {
extern "C" {
#define RETROGRADE_DRIVER(symbol, parameters) Result symbol parameters;
#include "gpu/driver_functions.def"
#undef RETROGRADE_DRIVER
Result cuCtxCreate_v2(Context*, unsigned flags, Device);
Result cuCtxDestroy_v2(Context);
Result cuMemHostRegister_v2(void*, size_t, unsigned flags);
Result cuMemHostUnregister(void*);
Result cuMemGetInfo_v2(size_t* free, size_t* total);
Result cuStreamCreate(Stream*, unsigned flags);
Result cuStreamDestroy_v2(Stream);
Result cuStreamQuery(Stream);
Result cuEventCreate(Event*, unsigned flags);
Result cuEventDestroy_v2(Event);
Result cuEventRecord(Event, Stream);
Result cuStreamWaitEvent(Stream, Event, unsigned flags);
Result cuEventSynchronize(Event);
Result cuStreamBeginCapture_v2(Stream, int mode);
Result cuStreamEndCapture(Stream, Graph*);
Result cuGraphInstantiateWithFlags(GraphExec*, Graph, uint64_t flags);
Result cuGraphLaunch(GraphExec, Stream);
Result cuGraphDestroy(Graph);
Result cuGraphExecDestroy(GraphExec);
}
}  // namespace retrograde::cuda

// Options for one test.
class SimulatedOptions {
 public:
  SimulatedOptions() { retrograde_simt_get_options(&before_); }
  ~SimulatedOptions() { retrograde_simt_set_options(&before_); }
  SimulatedOptions(const SimulatedOptions&) = delete;
  template <typename F>
  void change(F f) {
    retrograde_simt_options now;
    retrograde_simt_get_options(&now);
    f(now);
    retrograde_simt_set_options(&now);
  }

 private:
  retrograde_simt_options before_;
};

inline retrograde_simt_live live_objects() {
  retrograde_simt_live live;
  retrograde_simt_count_live(&live);
  return live;
}
