#include "simt/fibers.h"

#include <sys/mman.h>

#include <new>

namespace retrograde::simt {
namespace {

namespace context = boost::context::detail;

constexpr size_t stack_bytes = 256 << 10;  // the system commits only pages that are used
constexpr size_t guard_bytes = 4096;

// Stacks of finished fibers, for reuse; allocating one takes longer than running a short kernel.
std::vector<void*>& free_stacks() {
  static std::vector<void*>& stacks = *new std::vector<void*>;
  return stacks;
}

void* new_stack() {
  if (!free_stacks().empty()) {
    void* stack = free_stacks().back();
    free_stacks().pop_back();
    return stack;
  }
  void* stack = mmap(nullptr, stack_bytes, PROT_READ | PROT_WRITE,
                     MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (stack == MAP_FAILED) throw std::bad_alloc();
  mprotect(stack, guard_bytes, PROT_NONE);  // catches overflow
  return stack;
}

}  // namespace

Fiber::~Fiber() {
  if (stack_) free_stacks().push_back(stack_);
}

void Fiber::start(void (*run)(void*), void* argument) {
  if (!stack_) stack_ = new_stack();
  run_ = run;
  argument_ = argument;
  has_ended_ = false;
  inside_ = context::make_fcontext(static_cast<char*>(stack_) + stack_bytes, stack_bytes, entry);
}

void Fiber::entry(context::transfer_t from) {
  auto* self = static_cast<Fiber*>(from.data);
  self->outside_ = from.fctx;
  self->run_(self->argument_);
  self->has_ended_ = true;
  context::jump_fcontext(self->outside_, nullptr);
}

void Fiber::resume() { inside_ = context::jump_fcontext(inside_, this).fctx; }

void Fiber::suspend() { outside_ = context::jump_fcontext(outside_, nullptr).fctx; }

}  // namespace retrograde::simt
