// Programs: the kernels of one source, loaded once for each device that runs them.
#pragma once

#include <string>

#include "gpu/gpu_image.h"
#include "gpu/session.h"

namespace retrograde::runtime {

struct LoadedKernel {
  Function function = nullptr;
  int shared_bytes = 0;  // what it may use at most, as the driver was told
};

// What one device has of a program.
struct LoadedProgram {
  DeviceState* device = nullptr;
  Module module = nullptr;
  std::map<std::string, LoadedKernel, std::less<>> kernels;
};

class Program {
 public:
  Program(const void* source, int64_t bytes);
  // Still what it was made of: other code may have come to the same place.
  bool is_of(int64_t bytes) const { return bytes == bytes_ && fingerprint_ == fingerprint(); }

  // Loads it on the session's device unless it is there.
  int32_t load(const Session&);
  int32_t find(const Session&, const char* name, int32_t shared_bytes, Function&);
  // What the image says of a kernel; null where the source is PTX, or has no such kernel.
  const retrograde_gpu_kernel* description(const char* name) const;
  // Takes what a device has of it, or any device for null; the caller unloads it. Module null: nothing.
  LoadedProgram take(const DeviceState*);
  void put_back(LoadedProgram);

 private:
  const retrograde_gpu_image* image() const;
  uint64_t fingerprint() const;
  bool is_simulated() const;
  int32_t load_module(const Session&, Module&) const;
  int32_t allow_shared(const Session&, LoadedKernel&, int32_t bytes) const;
  LoadedProgram* on(const DeviceState&);

  const void* const source_;
  const int64_t bytes_;
  const uint64_t fingerprint_;
  std::mutex mutex_;  // of what is loaded; held while the driver compiles
  std::list<LoadedProgram> loaded_;
};

// assembler.cpp: what the program's assembler makes of PTX, loaded; false: nothing is.
bool load_assembled(const Session&, const char* ptx, uint64_t bytes, Module&);

std::shared_ptr<Program> find_program(const void* source);
// Made unless there is one.
std::shared_ptr<Program> make_program(const void* source, int64_t bytes);
std::shared_ptr<Program> forget_program(const void* source);

}  // namespace retrograde::runtime
