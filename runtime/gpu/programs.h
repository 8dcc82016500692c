// Programs: the kernels of one source, loaded once on each device that runs them.
#pragma once

#include <string>

#include "gpu/gpu_image.h"
#include "gpu/session.h"

namespace retrograde::runtime {

struct LoadedKernel {
  Function function = nullptr;
  int shared_bytes = 0;  // the shared-memory limit that the driver was given
};

// The part of a program that is loaded on one device.
struct LoadedProgram {
  DeviceState* device = nullptr;
  Module module = nullptr;
  std::map<std::string, LoadedKernel, std::less<>> kernels;
};

class Program {
 public:
  Program(const void* source, int64_t bytes);
  // Whether it still matches its source: other code may have been loaded at the same address.
  bool is_of(int64_t bytes) const { return bytes == bytes_ && fingerprint_ == fingerprint(); }

  // Loads it on the session's device unless it is loaded.
  int32_t load(const Session&);
  int32_t find(const Session&, const char* name, int32_t shared_bytes, Function&);
  // The image's description of a kernel; null if the source is PTX, or has no such kernel.
  const retrograde_gpu_kernel* description(const char* name) const;
  // Removes and returns what is loaded on a device, or on any device for null; the caller unloads it. A null module
  // means nothing is loaded.
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
  std::mutex mutex_;  // protects `loaded_`; held while the driver compiles
  std::list<LoadedProgram> loaded_;
};

// assembler.cpp: loads the code that the program's assembler makes from PTX; false if there is none.
bool load_assembled(const Session&, const char* ptx, uint64_t bytes, Module&);

std::shared_ptr<Program> find_program(const void* source);
// Returns the existing program, or makes one.
std::shared_ptr<Program> make_program(const void* source, int64_t bytes);
std::shared_ptr<Program> forget_program(const void* source);
// kernels.cpp: unloads all programs.
int32_t unload_all(const Request&);

}  // namespace retrograde::runtime
