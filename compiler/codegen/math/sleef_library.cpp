#include "codegen/math/sleef_library.h"

#include <dlfcn.h>

// Any function of SLEEF: the reference keeps the library loaded, and its address identifies the library.
extern "C" float Sleef_expf_u10(float);

namespace retrograde::codegen {
namespace {

// Finds SLEEF by the file that contains a known function. The process may have loaded us and SLEEF with local scope,
// which a global symbol search does not cover. If the address is that of a PLT entry in the program, the global search
// does find it.
void* sleef_library() {
  static void* const library = [] {
    Dl_info info;
    const bool found =
        dladdr(reinterpret_cast<void*>(Sleef_expf_u10), &info) != 0 && info.dli_fname;
    return found ? dlopen(info.dli_fname, RTLD_LAZY | RTLD_NOLOAD) : nullptr;
  }();
  return library;
}

}  // namespace

void* find_in_sleef(const char* name) {
  void *library = sleef_library(), *address = library ? dlsym(library, name) : nullptr;
  return address ? address : dlsym(RTLD_DEFAULT, name);
}

}  // namespace retrograde::codegen
