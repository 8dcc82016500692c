// The devices that the process uses, one for each CUDA context, and what is kept for them: memory and
// kernels. Contexts come from the caller, or are the devices' primary ones, shared with everything
// else in the process that uses them.
#pragma once

#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "gpu/driver.h"

namespace retrograde::runtime {

// A piece of device memory. `uses`: on which streams work with it may still be going on.
struct Block {
  Address base = 0;
  size_t bytes = 0;
  struct DeviceState* device = nullptr;
  enum class Uses { none, one_stream, several } uses = Uses::none;
  Stream stream = nullptr;     // that one
  bool is_used_again = false;  // work of its former life may be going on there
  uint64_t capture = 0;        // the graph that uses it, which nothing else may then
  // Of the caller's allocator; null: the driver's.
  int32_t (*release)(void* user_context, void* address, size_t bytes, void* stream) = nullptr;
};

struct DeviceState {
  Context context = nullptr;
  int number = 0;
  bool is_retained = false;  // a primary context that we hold
  size_t memory_bytes = 0;
  std::vector<Block> unused;  // the oldest first
  size_t unused_bytes = 0;
};

class Program;

// All of it under one lock, which is not held while the work of a device is waited for.
struct Devices {
  std::mutex mutex;
  std::list<DeviceState> all;
  int last = -1;  // the device that -1 stands for, once it is known
  std::map<Address, Block> live;
  std::map<Address, int> wrapped;  // how many buffers wrap memory that begins there
  std::map<const void*, std::shared_ptr<Program>> programs;  // by their source
};
Devices& devices();

// The context of a device, by its number or, for -1, of the last one; retained once. 0, or a code.
int32_t primary_context(const Request&, const Driver&, int number, Context&);
// What the current context's device is known as; made on first sight. 0, or a code.
int32_t state_of_context(const Request&, const Driver&, Context, DeviceState*&);

}  // namespace retrograde::runtime
