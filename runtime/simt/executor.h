// Runs the threads of a kernel, one block after another.
//
// If threads wait for one another, each thread is a fiber: it runs until it reaches a barrier or a shuffle, and then
// another thread runs. When no thread can continue, barriers that all threads of a warp or block have reached are
// released. If there are none, the kernel is in error. In other kernels, threads are calls in a loop.
#pragma once

#include <memory>
#include <optional>
#include <random>
#include <string>

#include "simt/fibers.h"
#include "simt/launch.h"
#include "simt/profile.h"
#include "simt/races.h"

namespace retrograde::simt {

enum class Wait { nothing, barrier, warp_barrier, shuffle, ended };

class Executor;

// The executor's data for a thread, placed after the fields that the kernel sees.
struct ThreadState : retrograde_simt_thread {
  Executor* executor = nullptr;
  uint32_t number = 0;  // in the block
  Wait wait = Wait::nothing;
  int32_t site = -1;   // where it waits
  uint32_t value = 0;  // of a shuffle: first its operand, then its result
  int32_t lane = 0, kind = 0;
  // A store over another thread's store. It is an error unless the value stays the same.
  struct Overwrite {
    const uint8_t* address;
    int32_t bytes, site, space;
    uint8_t before[64];
    uint64_t by_others;  // bit i: others stored byte i
    Moment other;
  };
  std::optional<Overwrite> overwrite;
};

class Executor {
 public:
  explicit Executor(const Launch&);
  Result run();

  // Functions that kernels call through the table of retrograde_simt_calls.
  void arrive(ThreadState&, Wait, int32_t site);
  uint32_t shuffle(ThreadState&, uint32_t value, int32_t lane, int32_t kind, int32_t site);
  void access(ThreadState&, const void* address, int32_t bytes, int32_t kind, int32_t space,
              int32_t site);

 private:
  // ---- running ----
  static void run_thread_of(void*);
  static void run_all_of(void*);
  void run_all_blocks();
  void run_block();
  void run_plain_block();
  void run_waiting_block();
  void begin_block(int64_t number);
  void begin_thread(ThreadState&);
  void run_round(uint32_t first, uint32_t count);
  void run_ahead();
  void order_threads(uint32_t first, uint32_t count);
  bool let_go();
  bool let_warp_go(uint32_t warp);
  bool let_block_go();
  void end_shuffle(uint32_t first, uint32_t count);
  bool is_running() const { return result_ == success && ended_ < count_; }

  // ---- errors ----
  void fail(Result, const std::string& text);
  void fail_in_kernel(Result, const std::string& text);
  void report_deadlock();
  std::string statement(int32_t site) const;
  std::string name_of(const Moment&) const;
  std::string name_of(const ThreadState&) const;
  std::string place_of(const void* address, int32_t space) const;

  // ---- accesses ----
  bool is_in_bounds(const uint8_t* address, int32_t bytes, int32_t space);
  void check_overwrite(ThreadState&);
  void check_race(ThreadState&, const uint8_t* address, int32_t bytes, Access, int32_t space,
                  int32_t site);
  void report_race(const ThreadState&, const void* address, int32_t space, int32_t site,
                   const char* did, const Moment& other, const char* other_did);
  Moment moment_of(const ThreadState&, int32_t site) const;

  const Launch& launch_;
  const retrograde_simt_options options_;
  const uint32_t count_;  // threads per block
  Result result_ = success;
  std::mt19937_64 chance_;

  std::unique_ptr<ThreadState[]> threads_;
  std::unique_ptr<Fiber[]> fibers_;  // one per thread, or one for all threads
  Fiber* running_ = nullptr;
  std::vector<uint32_t> order_;
  uint32_t ended_ = 0, block_ = 0, interval_ = 1;
  std::vector<uint32_t> parts_;  // of the interval, by warp
  std::vector<uint64_t> shared_words_;
  uint8_t* shared_ = nullptr;

  Address last_base_ = 0;  // the allocation of the last access
  size_t last_bytes_ = 0;
  Shadow global_shadow_, shared_shadow_;
  std::unique_ptr<Profile> profile_;
};

}  // namespace retrograde::simt
