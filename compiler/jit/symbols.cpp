#include "jit/symbols.h"

#include <dlfcn.h>

#include <cmath>
#include <cstring>
#include <map>

#include "codegen/math/sleef_library.h"
#include "gpu/gpu_calls.h"
#include "gpu/kernel_storage.h"
#include "inquiries.h"
#include "retrograde_runtime.h"

namespace retrograde::jit {
namespace {

template <typename F>
void* pointer(F* function) {
  return reinterpret_cast<void*>(function);
}

using Table = std::map<std::string, void*>;

Table make_table() {
  Table table;
  table["memcpy"] = pointer<void*(void*, const void*, size_t)>(std::memcpy);
  table["memmove"] = pointer<void*(void*, const void*, size_t)>(std::memmove);
  table["memset"] = pointer<void*(void*, int, size_t)>(std::memset);
  // The functions of libm are overloaded, so a type selects one.
#define RETROGRADE_RUNTIME(name) table[#name] = pointer(name);
#define RETROGRADE_UNARY(name)                    \
  table[#name] = pointer<double(double)>(::name); \
  table[#name "f"] = pointer<float(float)>(::name##f);
#define RETROGRADE_BINARY(name)                           \
  table[#name] = pointer<double(double, double)>(::name); \
  table[#name "f"] = pointer<float(float, float)>(::name##f);
#define RETROGRADE_TERNARY(name)                                  \
  table[#name] = pointer<double(double, double, double)>(::name); \
  table[#name "f"] = pointer<float(float, float, float)>(::name##f);
#include "jit/symbols.def"
#undef RETROGRADE_RUNTIME
#undef RETROGRADE_UNARY
#undef RETROGRADE_BINARY
#undef RETROGRADE_TERNARY
  return table;
}

}  // namespace

void* find_symbol(const std::string& name) {
  static const Table table = make_table();
  const auto found = table.find(name);
  if (found != table.end()) return found->second;
  if (name.rfind("Sleef_", 0) == 0) return codegen::find_in_sleef(name.c_str());
  return dlsym(RTLD_DEFAULT, name.c_str());
}

}  // namespace retrograde::jit
