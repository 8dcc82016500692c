// The state of the simulated driver: devices, contexts, and what belongs to them. One lock protects all of it; every
// driver call holds it, also while kernels run.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "gpu/driver_types.h"
#include "gpu/gpu_image.h"
#include "simt/options.h"

namespace retrograde::simt {

using namespace cuda;

std::mutex& driver_mutex();

struct ContextState;

// ---- device memory ----

struct Allocation {
  size_t bytes = 0;
  ContextState* context = nullptr;
};

// The memory of one device, in an address range that nothing else in the process uses.
class DeviceMemory {
 public:
  Result allocate(size_t bytes, ContextState*, Address&);
  Result free(Address);
  void free_all(const ContextState*);
  // The allocation that contains all these bytes, or null.
  const Allocation* find(Address, size_t bytes, Address* base = nullptr) const;
  const std::map<Address, Allocation>& live() const { return live_; }
  size_t used_bytes() const { return used_bytes_; }

 private:
  bool reserve();
  Address find_gap(size_t bytes) const;

  Address begin_ = 0;
  std::map<Address, Allocation> live_;
  size_t used_bytes_ = 0;
};

// ---- work ----

// One operation of a stream; it runs after all operations in `after`.
struct Operation {
  std::function<Result()> run;
  std::vector<std::shared_ptr<Operation>> after;
  bool is_done = false;
};
using OperationPtr = std::shared_ptr<Operation>;

struct GraphState {
  std::vector<std::function<Result()>> nodes;  // in order, because only one stream is captured
};

struct StreamState {
  ContextState* context = nullptr;
  bool is_blocking = true;  // whether it and the default stream wait for each other
  OperationPtr last;
  // During a capture:
  std::unique_ptr<GraphState> capture;
  uint64_t capture_id = 0;
  bool is_invalidated = false;
  int capture_mode = 0;  // 0: global, 1: this thread only, 2: relaxed
  const void* capture_thread = nullptr;
};

struct EventState {
  OperationPtr last;
};

struct ModuleState {
  const retrograde_gpu_image* image = nullptr;
  struct FunctionState {
    const retrograde_gpu_kernel* kernel;
    int shared_limit;
  };
  std::map<std::string, std::unique_ptr<FunctionState>> functions;
};

struct ContextState {
  int device = 0;
  bool is_primary = false;
  int references = 0;
  Result lost = success;  // a permanent error
  StreamState default_stream;
  std::set<std::unique_ptr<StreamState>> streams;
  std::set<std::unique_ptr<ModuleState>> modules;
  std::vector<OperationPtr> pending;  // in the order in which they were enqueued
};

struct State {
  std::map<int, DeviceMemory> memory;  // by device
  std::set<std::unique_ptr<ContextState>> contexts;
  std::set<std::unique_ptr<EventState>> events;
  std::set<std::unique_ptr<GraphState>> graphs;
  std::map<const uint8_t*, size_t> locked_host;  // page-locked host memory
  retrograde_simt_copied copied = {};
  uint64_t captures = 0;
  bool is_initialized = false;
};
State& state();

ContextState*& current_context();  // of this thread
// Identifies the calling thread.
const void* this_thread();
int& capture_mode_of_this_thread();

// The matching element of a set of pointers, or null.
template <typename T>
T* find_in(const std::set<std::unique_ptr<T>>& all, const void* wanted) {
  for (const auto& one : all) {
    if (one.get() == wanted) return one.get();
  }
  return nullptr;
}
template <typename T>
bool erase_from(std::set<std::unique_ptr<T>>& all, const void* wanted) {
  for (auto it = all.begin(); it != all.end(); ++it) {
    if (it->get() != wanted) continue;
    all.erase(it);
    return true;
  }
  return false;
}

// ---- streams.cpp ----

StreamState* find_stream(ContextState&, Stream);
// Adds work to the stream or, during a capture, to the graph.
Result enqueue(StreamState&, std::function<Result()>);
// Runs operations until all of these have run.
Result complete(ContextState&, const std::vector<OperationPtr>&);
Result complete_all(ContextState&);
Result complete_stream(StreamState&);
// Rejects calls that are forbidden while this thread, or any thread in global mode, captures, unless this thread is in
// relaxed mode. A rejected call invalidates the captures.
Result refuse_in_capture();
Result refuse_on(StreamState&);  // rejects work that a captured stream forbids

// ---- finding.cpp ----

// The text for the next error.
void set_finding(const std::string&);
const std::string& finding();

}  // namespace retrograde::simt
