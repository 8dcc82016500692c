// privatize -- turn a block's storage in registers into private storage of each thread.
//
//   allocate sum[128]:float32 register {                   allocate sum[1]:float32 stack {
//     gpu_thread for (y, 0, 8) {                             gpu_thread for (y, 0, 8) {
//       gpu_thread for (x, 0, 16) { sum[x + y * 16] = 0 }  =>  gpu_thread for (x, 0, 16) { sum[0] = 0 }
//     }                                                      }
//     ...                                                    ...
//   }                                                      }
//
// UserError if a thread would read elements that another one stored; see thread_elements.h.
#include "diagnostics/error.h"
#include "ir/visit.h"
#include "lower/device/kernel.h"
#include "lower/device/thread_elements.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

std::vector<std::string> names_in_registers(const Stmt& s) {
  std::vector<std::string> names;
  walk(s, [&](const Allocate& n) {
    if (n.memory == MemoryType::Register) names.push_back(n.name);
  });
  return names;
}

Stmt resized(const Stmt& s, const std::string& storage, int64_t elements) {
  return rewrite_statements(s, [&](const Stmt& part, auto& rewriter) {
    const auto* n = part.as<Allocate>();
    if (!n || n->name != storage) return rewriter.children(part);
    return make_allocate(n->name, n->type, MemoryType::Stack,
                         make_const(n->elements.type(), elements), n->body);
  });
}

}  // namespace

void privatize(Kernel& kernel) {
  for (const std::string& name : names_in_registers(kernel.body)) {
    const auto elements = find_thread_elements(kernel, name);
    if (!elements) {
      user_error(text("store ", quoted(name), " in registers"),
                 "a thread reads of its registers what it stored itself",
                 text("not every element of ", quoted(name),
                      " is known to be stored and read by one thread alone"),
                 "Store it in MemoryType::GPUShared, or run the loops that store and read it over "
                 "threads in the same way");
    }
    kernel.body = renumbered_privately(kernel, name, *elements);
    kernel.body = resized(kernel.body, name, elements->own_count);
  }
}

}  // namespace retrograde::lower
