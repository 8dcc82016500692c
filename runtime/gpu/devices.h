// The devices that the process uses, one entry per CUDA context, with the memory and kernels that each one holds.
// Contexts come from the caller, or are the devices' primary contexts, which the whole process shares.
#pragma once

#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "gpu/driver.h"

namespace retrograde::runtime {

// A block of device memory. `uses`: the streams whose work may still be using it.
struct Block {
  Address base = 0;
  size_t bytes = 0;
  struct DeviceState* device = nullptr;
  enum class Uses { none, one_stream, several } uses = Uses::none;
  Stream stream = nullptr;  // if `uses` is one_stream
  bool is_used_again =
      false;             // work that used the block before its last release may be pending there
  uint64_t capture = 0;  // the graph that it is reserved for; 0: none
  // The caller's release function; null for the driver's memory.
  int32_t (*release)(void* user_context, void* address, size_t bytes, void* stream) = nullptr;
};

struct DeviceState {
  Context context = nullptr;
  int number = 0;
  bool is_retained = false;  // a primary context that we hold
  size_t memory_bytes = 0;
  std::vector<Block> unused;  // oldest first
  size_t unused_bytes = 0;
};

class Program;

// One lock protects all of this. It is not held while waiting for a device.
struct Devices {
  std::mutex mutex;
  std::list<DeviceState> all;
  int last = -1;  // the device that -1 stands for, once known
  std::map<Address, Block> live;
  std::map<Address, int> wrapped;  // number of buffers that wrap memory at this address
  std::map<const void*, std::shared_ptr<Program>> programs;  // by source
};
Devices& devices();

// The primary context of a device, by number or, for -1, of the last device; retained once. Returns 0 or an error code.
int32_t primary_context(const Request&, const Driver&, int number, Context&);
// The entry of the current context, created on first use. Returns 0 or an error code.
int32_t state_of_context(const Request&, const Driver&, Context, DeviceState*&);

}  // namespace retrograde::runtime
