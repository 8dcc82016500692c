#include "lower/device/make_kernels.h"

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "lower/device/kernel.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

class KernelMaker : public StatementRewriter {
 public:
  KernelMaker(const Stmt& s, const Target& target) : fresh_(s), target_(target) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (const auto* n = s.as<Allocate>(); n && n->memory == MemoryType::GPUShared) {
      user_error(text("store ", quoted(n->name), " in shared memory"),
                 "shared memory is that of the threads of a block",
                 text(quoted(n->name), " is stored outside of all loops over blocks"),
                 "Compute it in a loop over blocks, or use MemoryType::Auto, Heap or Stack");
    }
    const auto* loop = s.as<For>();
    if (!loop) return children(s);
    if (is_gpu_thread(loop->runs)) {
      user_error("run GPU threads of " + describe_loop(loop->name), "threads belong to blocks",
                 "no loop over blocks is around the loop",
                 "Run a loop around it over blocks, with gpu_blocks or gpu_tile");
    }
    if (loop->runs == ForType::GpuBlock) return launch(*loop);
    parallel_around_ += loop->runs == ForType::Parallel;
    Stmt result = children(s);
    parallel_around_ -= loop->runs == ForType::Parallel;
    return result;
  }

 private:
  Stmt launch(const For& loop) {
    if (parallel_around_ > 0) {
      unsupported("run GPU blocks of " + describe_loop(loop.name),
                  "kernels are launched by one thread of the host",
                  "a parallel loop is around the loop over blocks",
                  "Keep the loop around it serial, or run it over blocks, too");
    }
    const std::string func = decode_loop_name(loop.name).func;
    Kernel kernel = find_grid(fresh_(func + ".kernel"), loop);
    check_statements(kernel.body, loop);
    choose_threads(kernel);
    privatize(kernel);
    place_shared(kernel, most_shared_bytes(target_));
    insert_barriers(kernel);
    place_heap(kernel);
    map_threads(kernel);
    Stmt result = simplify(
        make_launch(kernel.name, kernel.blocks, kernel.threads, kernel.shared_bytes, kernel.body));
    for (const Kernel::Heap& heap : kernel.heap)
      result = make_allocate(heap.name, heap.type, MemoryType::Heap, heap.elements, result);
    return result;
  }

  // Rejects statements that only the host can run.
  static void check_statements(const Stmt& body, const For& loop) {
    const auto refuse = [&](const std::string& evidence, const std::string& instead) {
      unsupported("run GPU blocks of " + describe_loop(loop.name),
                  "a kernel cannot call functions of the host", evidence, instead);
    };
    walk(
        body,
        [&](const For& n) {
          if (n.runs == ForType::Parallel)
            refuse(text("the loop ", describe_loop(n.name), " in it is parallel"),
                   "Keep it serial");
        },
        [&](const Fork&) {
          refuse("an async Func in it runs in a thread of the host", "Drop async()");
        },
        [&](const StringImm& n) {
          refuse(text("it takes the address of the text ", Expr(&n)), "Compute it on the host");
        },
        [&](const Call& n) {
          if (n.call_type == CallType::Extern)
            refuse(text("it calls the C function ", quoted(n.name)), "Compute it on the host");
          for (const Op op :
               {Op::print, Op::print_when, Op::require, Op::trace, Op::runtime_call}) {
            if (n.is_op(op)) refuse(text("it does ", op_info(op).name), "Compute it on the host");
          }
        });
  }

  FreshNames fresh_;
  const Target& target_;
  int parallel_around_ = 0;
};

}  // namespace

int most_shared_bytes(const Target& target) {
  constexpr int kilobyte = 1024;
  // CUDA C++ Programming Guide, table of technical specifications per compute capability.
  constexpr std::pair<int, int> limits[] = {{90, 227}, {86, 99}, {80, 163}, {75, 64}, {70, 96}};
  for (const auto& [capability, kilobytes] : limits) {
    if (target.cuda_capability() == capability) return kilobytes * kilobyte;
  }
  return 48 * kilobyte;
}

Stmt make_kernels(const Stmt& s, const Target& target, const GivenBuffers& given) {
  const Stmt with_kernels = KernelMaker(s, target)(s);
  if (!target.has_feature(Target::CUDA)) return with_kernels;
  return insert_device_transfers(with_kernels, given);
}

}  // namespace retrograde::lower
