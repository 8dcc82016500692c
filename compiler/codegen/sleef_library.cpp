#include "codegen/sleef_library.h"

#include <dlfcn.h>

// A function of SLEEF, to keep the library loaded and to find it by.
extern "C" float Sleef_expf_u10(float);

namespace retrograde::codegen {
namespace {

// By the file that holds a known function: the process may have loaded us and SLEEF privately,
// where a search of the whole process does not look. (Where the address is that of a jump inside a
// program, that search does find it.)
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
