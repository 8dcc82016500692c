// Fibers: where a kernel's thread waits for others, another one goes on. A fiber that is abandoned is
// never unwound, for compiled kernels cannot be; its stack is used again.
#pragma once

#include <boost/context/detail/fcontext.hpp>
#include <cstddef>
#include <vector>

namespace retrograde::simt {

class Fiber {
 public:
  // `run` gets `argument`; when it returns, the fiber has ended.
  void start(void (*run)(void*), void* argument);
  // From outside: until it suspends itself or ends.
  void resume();
  // From inside.
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
