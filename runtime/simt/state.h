// What the simulated driver keeps: devices, contexts and what belongs to them. One lock for all of it,
// held during every call of the driver, kernels included.
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

// An address range of its own for each device, which nothing else in the process is in.
class DeviceMemory {
 public:
  Result allocate(size_t bytes, ContextState*, Address&);
  Result free(Address);
  void free_all(const ContextState*);
  // The allocation that all these bytes are in, or null.
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

// One operation of a stream; it runs once all that it waits for has run.
struct Operation {
  std::function<Result()> run;
  std::vector<std::shared_ptr<Operation>> after;
  bool is_done = false;
};
using OperationPtr = std::shared_ptr<Operation>;

struct GraphState {
  std::vector<std::function<Result()>> nodes;  // in order: one stream is captured
};

struct StreamState {
  ContextState* context = nullptr;
  bool is_blocking = true;  // it waits for the default stream, and the other way round
  OperationPtr last;
  // While a graph is captured:
  std::unique_ptr<GraphState> capture;
  uint64_t capture_id = 0;
  bool is_invalidated = false;
  int capture_mode = 0;  // 0: global, 1: of this thread, 2: relaxed
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
  Result lost = success;  // an error that stays
  StreamState default_stream;
  std::set<std::unique_ptr<StreamState>> streams;
  std::set<std::unique_ptr<ModuleState>> modules;
  std::vector<OperationPtr> pending;  // in the order that they were asked for
};

struct State {
  std::map<int, DeviceMemory> memory;  // by device
  std::set<std::unique_ptr<ContextState>> contexts;
  std::set<std::unique_ptr<EventState>> events;
  std::set<std::unique_ptr<GraphState>> graphs;
  std::map<const uint8_t*, size_t> locked_host;  // memory that is locked to its pages
  retrograde_simt_copied copied = {};
  uint64_t captures = 0;
  bool is_initialized = false;
};
State& state();

ContextState*& current_context();  // of this thread
// Identifies the thread.
const void* this_thread();
int& capture_mode_of_this_thread();

// The element of a set of pointers, or null.
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
// Adds work, to the graph where the stream is captured.
Result enqueue(StreamState&, std::function<Result()>);
// Runs until all of these have run.
Result complete(ContextState&, const std::vector<OperationPtr>&);
Result complete_all(ContextState&);
Result complete_stream(StreamState&);
// Refuses what may not be called while this thread, or anyone in global mode, captures, unless this
// thread is in relaxed mode; the captures are invalid then.
Result refuse_in_capture();
Result refuse_on(StreamState&);  // of work that a captured stream cannot have

// ---- finding.cpp ----

// Text that goes with the next error.
void set_finding(const std::string&);
const std::string& finding();

}  // namespace retrograde::simt
