// Executes a kernel's threads, barriers and shuffles.
#include "simt/executor.h"

#include <algorithm>
#include <cstring>
#include <numeric>

namespace retrograde::simt {
namespace {

constexpr uint32_t warp_threads = 32;

ThreadState& state_of(retrograde_simt_thread* thread) { return *static_cast<ThreadState*>(thread); }

constexpr retrograde_simt_calls calls = {
    [](retrograde_simt_thread* thread, int32_t site) {
      state_of(thread).executor->arrive(state_of(thread), Wait::barrier, site);
    },
    [](retrograde_simt_thread* thread, int32_t site) {
      state_of(thread).executor->arrive(state_of(thread), Wait::warp_barrier, site);
    },
    [](retrograde_simt_thread* thread, uint32_t value, int32_t lane, int32_t kind, int32_t site) {
      return state_of(thread).executor->shuffle(state_of(thread), value, lane, kind, site);
    },
    [](retrograde_simt_thread* thread, const void* address, int32_t bytes, int32_t kind,
       int32_t space, int32_t site) {
      state_of(thread).executor->access(state_of(thread), address, bytes, kind, space, site);
    }};

int32_t lane_read(int32_t own, int32_t lane, int32_t kind) {
  switch (kind) {
    case retrograde_simt_up:
      return own - lane < 0 ? own : own - lane;
    case retrograde_simt_down:
      return own + lane > 31 ? own : own + lane;
    case retrograde_simt_xor:
      return (own ^ lane) & 31;
    default:
      return lane & 31;
  }
}

}  // namespace

Executor::Executor(const Launch& launch)
    : launch_(launch),
      options_(options()),
      count_(static_cast<uint32_t>(launch.threads_of_block())),
      chance_(options_.seed),
      threads_(std::make_unique<ThreadState[]>(count_)),
      parts_((count_ + warp_threads - 1) / warp_threads),
      shared_words_(static_cast<size_t>(launch.shared_bytes) / 8 + 33) {
  const bool waits = launch.kernel->suspends != 0;
  fibers_ = std::make_unique<Fiber[]>(waits ? count_ : 1);
  const auto first = reinterpret_cast<uintptr_t>(shared_words_.data());
  shared_ = reinterpret_cast<uint8_t*>((first + 255) / 256 * 256);
  if (options_.profile) profile_ = std::make_unique<Profile>(launch.kernel->num_sites);
  for (uint32_t t = 0; t < count_; t++) {
    ThreadState& thread = threads_[t];
    thread.calls = &calls;
    thread.shared = shared_;
    thread.executor = this;
    thread.number = t;
    std::copy_n(launch.blocks, 3, thread.blocks);
    std::copy_n(launch.threads, 3, thread.threads);
    thread.thread[0] = static_cast<int32_t>(t) % launch.threads[0];
    thread.thread[1] = static_cast<int32_t>(t) / launch.threads[0] % launch.threads[1];
    thread.thread[2] = static_cast<int32_t>(t) / launch.threads[0] / launch.threads[1];
  }
}

Result Executor::run() {
  if (launch_.kernel->suspends) {
    run_all_blocks();
  } else {
    running_ = &fibers_[0];
    running_->start(run_all_of, this);
    running_->resume();
  }
  if (profile_) {
    profile_->sums.launches = 1;
    profile_->sums.blocks = launch_.number_of_blocks();
    profile_->sums.threads = launch_.number_of_blocks() * count_;
    add_profile(launch_.kernel->name, profile_->sums);
  }
  return result_;
}

void Executor::run_all_of(void* self) { static_cast<Executor*>(self)->run_all_blocks(); }

void Executor::run_all_blocks() {
  const int64_t blocks = launch_.number_of_blocks();
  const bool reversed = options_.order == retrograde_simt_reverse;
  for (int64_t i = 0; i < blocks && result_ == success; i++) {
    begin_block(reversed ? blocks - 1 - i : i);
    if (launch_.kernel->suspends)
      run_waiting_block();
    else
      run_plain_block();
    if (profile_) profile_->end_block();
  }
}

void Executor::begin_block(int64_t number) {
  block_ = static_cast<uint32_t>(number);
  interval_ = 1;
  ended_ = 0;
  std::fill(parts_.begin(), parts_.end(), 0u);
  shared_shadow_.clear();
  std::memset(shared_, 0xff, static_cast<size_t>(launch_.shared_bytes));
  const int64_t x = launch_.blocks[0], y = launch_.blocks[1];
  for (uint32_t t = 0; t < count_; t++) {
    threads_[t].block[0] = static_cast<int32_t>(number % x);
    threads_[t].block[1] = static_cast<int32_t>(number / x % y);
    threads_[t].block[2] = static_cast<int32_t>(number / x / y);
    threads_[t].wait = Wait::nothing;
    threads_[t].overwrite.reset();
  }
}

void Executor::begin_thread(ThreadState& thread) {
  launch_.kernel->simt(&thread, reinterpret_cast<const uint8_t*>(launch_.args.data()));
  check_overwrite(thread);
}

// ---- orders ----

void Executor::order_threads(uint32_t first, uint32_t count) {
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), first);
  if (options_.order == retrograde_simt_reverse) std::reverse(order_.begin(), order_.end());
  if (options_.order == retrograde_simt_random) std::shuffle(order_.begin(), order_.end(), chance_);
}

void Executor::run_plain_block() {
  order_threads(0, count_);
  if (options_.order == retrograde_simt_warp_ahead) {
    const auto warp = static_cast<uint32_t>(chance_() % parts_.size()) * warp_threads;
    std::rotate(order_.begin(), order_.begin() + warp, order_.end());
  }
  for (const uint32_t t : order_) begin_thread(threads_[t]);
}

// ---- waiting threads ----

void Executor::run_thread_of(void* thread) {
  auto& self = *static_cast<ThreadState*>(thread);
  self.executor->begin_thread(self);
  self.wait = Wait::ended;
  self.executor->ended_++;
}

void Executor::run_waiting_block() {
  for (uint32_t t = 0; t < count_; t++) fibers_[t].start(run_thread_of, &threads_[t]);
  while (is_running()) {
    if (options_.order == retrograde_simt_warp_ahead) run_ahead();
    run_round(0, count_);
    if (!is_running()) return;
    if (!let_go()) report_deadlock();
  }
}

void Executor::run_round(uint32_t first, uint32_t count) {
  order_threads(first, count);
  for (const uint32_t t : order_) {
    if (threads_[t].wait != Wait::nothing) continue;
    running_ = &fibers_[t];
    running_->resume();
    if (result_ != success) return;
  }
}

// Lets one warp run as far as it can alone.
void Executor::run_ahead() {
  const auto warp = static_cast<uint32_t>(chance_() % parts_.size());
  const uint32_t first = warp * warp_threads;
  do {
    run_round(first, std::min(warp_threads, count_ - first));
  } while (is_running() && let_warp_go(warp));
}

bool Executor::let_go() {
  bool some = false;
  for (uint32_t warp = 0; warp < parts_.size(); warp++) some |= let_warp_go(warp);
  return some || let_block_go();
}

bool Executor::let_warp_go(uint32_t warp) {
  const uint32_t first = warp * warp_threads, count = std::min(warp_threads, count_ - first);
  const ThreadState& one = threads_[first];
  if (one.wait != Wait::warp_barrier && one.wait != Wait::shuffle) return false;
  for (uint32_t t = first; t < first + count; t++) {
    if (threads_[t].wait != one.wait || threads_[t].site != one.site) return false;
  }
  if (one.wait == Wait::shuffle) {
    end_shuffle(first, count);
  } else {
    parts_[warp]++;
    if (profile_) profile_->sums.warp_barriers++;
  }
  for (uint32_t t = first; t < first + count; t++) threads_[t].wait = Wait::nothing;
  return result_ == success;
}

bool Executor::let_block_go() {
  for (uint32_t t = 0; t < count_; t++) {
    if (threads_[t].wait != Wait::barrier || threads_[t].site != threads_[0].site) return false;
  }
  for (uint32_t t = 0; t < count_; t++) threads_[t].wait = Wait::nothing;
  interval_++;
  std::fill(parts_.begin(), parts_.end(), 0u);
  if (profile_) profile_->sums.barriers++;
  return true;
}

void Executor::end_shuffle(uint32_t first, uint32_t count) {
  uint32_t given[warp_threads];
  for (uint32_t i = 0; i < count; i++) given[i] = threads_[first + i].value;
  for (uint32_t i = 0; i < count; i++) {
    ThreadState& thread = threads_[first + i];
    const int32_t from = lane_read(static_cast<int32_t>(i), thread.lane, thread.kind);
    if (from >= static_cast<int32_t>(count)) {
      fail(launch_failed, "a shuffle must read a lane that is there: " + name_of(thread) +
                              " reads lane " + std::to_string(from) + " of a warp of " +
                              std::to_string(count) + " threads" + statement(thread.site));
      return;
    }
    thread.value = given[from];
  }
  if (profile_) profile_->sums.shuffles++;
}

void Executor::arrive(ThreadState& thread, Wait wait, int32_t site) {
  check_overwrite(thread);
  if (!launch_.kernel->suspends)
    fail_in_kernel(launch_failed, "a kernel that waits must say so: " + name_of(thread) +
                                      " waits, and the kernel's `suspends` is 0" + statement(site));
  thread.wait = wait;
  thread.site = site;
  running_->suspend();
}

uint32_t Executor::shuffle(ThreadState& thread, uint32_t value, int32_t lane, int32_t kind,
                           int32_t site) {
  thread.value = value;
  thread.lane = lane;
  thread.kind = kind;
  arrive(thread, Wait::shuffle, site);
  return thread.value;
}

Result run(const Launch& launch) {
  set_finding("");
  Executor executor(launch);
  return executor.run();
}

}  // namespace retrograde::simt
