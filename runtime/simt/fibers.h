// Fibers: when a kernel's thread waits for others, another one runs. An abandoned fiber is never unwound, because
// compiled kernels have no unwind tables; its stack is reused.
#pragma once

#include <boost/context/detail/fcontext.hpp>
#include <cstddef>
#include <vector>

namespace retrograde::simt {

class Fiber {
 public:
  // Runs `run(argument)` in the fiber, which ends when it returns.
  void start(void (*run)(void*), void* argument);
  // Called from outside: runs the fiber until it suspends itself or ends.
  void resume();
  // Called from inside.
  void suspend();
  bool has_ended() const { return has_ended_; }
  ~Fiber();

 private:
  static void entry(boost::context::detail::transfer_t);
  boost::context::detail::fcontext_t inside_ = nullptr, outside_ = nullptr;
  void (*run_)(void*) = nullptr;
  void* argument_ = nullptr;
  void* stack_ = nullptr;
  bool has_ended_ = true;
};

}  // namespace retrograde::simt
