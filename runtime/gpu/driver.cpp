// Opens the CUDA driver library.
#include "gpu/driver.h"

#include <dlfcn.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>

#include "gpu/host.h"

namespace retrograde::runtime {
namespace {

struct Library {
  void* handle = nullptr;
  bool is_simulated = false;
  void* symbol(const char* name) const {
    return is_simulated ? dlsym(handle, name) : host().library_symbol(handle, name);
  }
};

// The folder of the file that contains this code, with a trailing slash.
std::string own_folder() {
  Dl_info info;
  if (!dladdr(reinterpret_cast<void*>(&open_driver), &info) || !info.dli_fname) return "";
  const std::string path = info.dli_fname;
  return path.substr(0, path.rfind('/') + 1);
}

void* load_simulated() {
  constexpr const char* name = "libretrograde_simt.so";
  if (const char* given = std::getenv("RETROGRADE_SIMT_LIBRARY"))
    return dlopen(given, RTLD_NOW | RTLD_GLOBAL);
  if (void* there = dlopen(name, RTLD_NOW | RTLD_NOLOAD)) return there;
  if (void* beside = dlopen((own_folder() + name).c_str(), RTLD_NOW)) return beside;
  return dlopen(name, RTLD_NOW);
}

// Returns false after reporting an error.
bool load(const Request& request, Library& library) {
  const char* chosen = std::getenv("RETROGRADE_GPU");
  if (!chosen || !*chosen || std::strcmp(chosen, "cuda") == 0) {
    library = {host().load_library("libcuda.so.1"), false};
    if (library.handle) return true;
    request.refuse(
        "CUDA's driver must be installed",
        "libcuda.so.1 was not found among the system's libraries",
        "Install the driver, or set RETROGRADE_GPU=simulated to use the simulated device");
  } else if (std::strcmp(chosen, "simulated") == 0) {
    library = {load_simulated(), true};
    if (library.handle) return true;
    const char* error = dlerror();
    request.refuse("the simulated device must be installed",
                   Line("libretrograde_simt.so was not opened (%s)", error ? error : "not found"),
                   "Name its file in RETROGRADE_SIMT_LIBRARY, or its folder in LD_LIBRARY_PATH");
  } else {
    request.refuse("RETROGRADE_GPU in the environment must be \"cuda\" or \"simulated\"",
                   Line("it is \"%s\"", chosen), "Set it to one of them, or unset it");
  }
  return false;
}

template <typename F>
void look_up(const Library& library, const char* name, F*& function, const char*& missing) {
  function = reinterpret_cast<F*>(library.symbol(name));
  if (!function) missing = name;
}

// The name of a function that the library lacks; null if it has all.
const char* fill(const Library& library, Driver& driver) {
  const char* missing = nullptr;
#define RETROGRADE_DRIVER(symbol, parameters) look_up(library, #symbol, driver.symbol, missing);
#include "gpu/driver_functions.def"
#undef RETROGRADE_DRIVER
  driver.is_simulated = library.is_simulated;
  return missing;
}

Driver the_driver;
bool is_filled = false;
std::atomic<bool> is_open{false};
std::mutex opening;

}  // namespace

const Driver* driver_if_open() {
  return is_open.load(std::memory_order_acquire) ? &the_driver : nullptr;
}

const Driver* open_driver(const Request& request) {
  if (const Driver* driver = driver_if_open()) return driver;
  const std::lock_guard lock(opening);
  if (!is_filled) {
    Library library;
    if (!load(request, library)) return nullptr;
    if (const char* missing = fill(library, the_driver)) {
      request.refuse("the driver must be of CUDA 11.3 or newer",
                     Line("its library has no function %s", missing), "Install a newer driver");
      return nullptr;
    }
    is_filled = true;
  }
  if (const Result result = the_driver.cuInit(0); result != success) {
    request.driver_failed(the_driver, "cuInit", result);
    return nullptr;
  }
  is_open.store(true, std::memory_order_release);
  return &the_driver;
}

}  // namespace retrograde::runtime
