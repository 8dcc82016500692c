// The errors that the executor detects, and their messages.
#include <algorithm>
#include <cstring>

#include "simt/executor.h"

namespace retrograde::simt {
namespace {

std::string triple(const int32_t (&v)[3]) {
  return "(" + std::to_string(v[0]) + ", " + std::to_string(v[1]) + ", " + std::to_string(v[2]) +
         ")";
}

const char* waiting_for(Wait wait) {
  if (wait == Wait::barrier) return "waits at a barrier";
  if (wait == Wait::warp_barrier) return "waits at a barrier of its warp";
  if (wait == Wait::shuffle) return "waits at a shuffle";
  return wait == Wait::ended ? "has ended" : "runs";
}

const char* verb_of(Access access) {
  return access == Access::load ? "load" : access == Access::store ? "store" : "atomic update";
}

}  // namespace

// ---- text ----

std::string Executor::statement(int32_t site) const {
  if (site < 0 || site >= launch_.kernel->num_sites) return "";
  return std::string(", in \"") + launch_.kernel->sites[site] + "\"";
}

std::string Executor::name_of(const ThreadState& thread) const {
  return "thread " + triple(thread.thread) + " of block " + triple(thread.block);
}

std::string Executor::name_of(const Moment& moment) const {
  const int64_t x = launch_.blocks[0], y = launch_.blocks[1], b = moment.block;
  const int32_t block[3] = {static_cast<int32_t>(b % x), static_cast<int32_t>(b / x % y),
                            static_cast<int32_t>(b / x / y)};
  return "thread " + triple(threads_[moment.thread].thread) + " of block " + triple(block);
}

std::string Executor::place_of(const void* address, int32_t space) const {
  const auto* byte = static_cast<const uint8_t*>(address);
  if (space == retrograde_simt_shared)
    return "byte " + std::to_string(byte - shared_) + " of shared memory";
  Address base = 0;
  const Allocation* found =
      state().memory[launch_.device].find(reinterpret_cast<Address>(address), 1, &base);
  if (!found) return "global memory";
  return "byte " + std::to_string(reinterpret_cast<Address>(address) - base) +
         " of an allocation of " + std::to_string(found->bytes) + " bytes";
}

// ---- failing ----

void Executor::fail(Result result, const std::string& text) {
  if (result_ != success) return;
  result_ = result;
  set_finding(std::string("kernel ") + launch_.kernel->name + ": " + text);
}

// Called in a fiber, which never resumes.
void Executor::fail_in_kernel(Result result, const std::string& text) {
  fail(result, text);
  running_->suspend();
}

// Reports a deadlock: the first thread that waits, and another thread that should wait for the same barrier and does
// not.
void Executor::report_deadlock() {
  const ThreadState *all = threads_.get(), *all_end = all + count_;
  const auto* first =
      std::find_if(all, all_end, [](const ThreadState& t) { return t.wait != Wait::ended; });
  const bool of_block = first->wait == Wait::barrier;
  const ThreadState* begin = of_block ? all : all + first->number / 32 * 32;
  const ThreadState* end = of_block ? all_end : std::min(begin + 32, all_end);
  const auto* other = std::find_if(begin, end, [&](const ThreadState& t) {
    return t.wait != first->wait || t.site != first->site;
  });
  const char* rule = first->wait == Wait::shuffle ? "all lanes of a warp arrive at a shuffle: "
                     : of_block ? "all threads of a block arrive at the same barrier: "
                                : "all threads of a warp arrive at the same barrier: ";
  fail(launch_failed, rule + name_of(*first) + " " + waiting_for(first->wait) +
                          statement(first->site) + "; " + name_of(*other) + " " +
                          waiting_for(other->wait) +
                          (other->wait == Wait::ended ? "" : statement(other->site)));
}

// ---- accesses ----

bool Executor::is_in_bounds(const uint8_t* address, int32_t bytes, int32_t space) {
  if (bytes < 0) return false;
  if (space == retrograde_simt_shared)
    return address >= shared_ && address - shared_ <= launch_.shared_bytes &&
           bytes <= launch_.shared_bytes - (address - shared_);
  const auto at = reinterpret_cast<Address>(address);
  const auto size = static_cast<size_t>(bytes);
  if (at - last_base_ <= last_bytes_ && last_bytes_ - (at - last_base_) >= size) return true;
  Address base = 0;
  const Allocation* found = state().memory[launch_.device].find(at, size, &base);
  if (!found) return false;
  last_base_ = base;
  last_bytes_ = found->bytes;
  return true;
}

Moment Executor::moment_of(const ThreadState& thread, int32_t site) const {
  Moment now;
  now.block = block_;
  now.interval = interval_;
  now.thread = static_cast<uint16_t>(thread.number);
  now.part = parts_[thread.number / 32];
  now.site = static_cast<int16_t>(site);
  return now;
}

void Executor::access(ThreadState& thread, const void* address, int32_t bytes, int32_t kind,
                      int32_t space, int32_t site) {
  if (thread.overwrite) check_overwrite(thread);
  if (space == retrograde_simt_local) return;
  const auto* byte = static_cast<const uint8_t*>(address);
  const auto access = static_cast<Access>(kind);
  if (!is_in_bounds(byte, bytes, space))
    fail_in_kernel(illegal_address,
                   std::string("an access must lie inside of one live allocation: ") +
                       name_of(thread) + " has a " + verb_of(access) + " of " +
                       std::to_string(bytes) + " bytes at " + place_of(address, space) +
                       (space == retrograde_simt_shared
                            ? ", of which the block has " + std::to_string(launch_.shared_bytes)
                            : "") +
                       statement(site));
  if (options_.find_races) check_race(thread, byte, bytes, access, space, site);
  if (profile_)
    profile_->add(thread.number, site, reinterpret_cast<Address>(address), bytes, access,
                  space == retrograde_simt_shared);
}

void Executor::check_race(ThreadState& thread, const uint8_t* address, int32_t bytes, Access access,
                          int32_t space, int32_t site) {
  const bool is_shared = space == retrograde_simt_shared;
  Shadow& shadow = is_shared ? shared_shadow_ : global_shadow_;
  const Conflict conflict =
      shadow.record(reinterpret_cast<Address>(address), bytes, access, moment_of(thread, site));
  if (!conflict.is_there) return;
  ThreadState::Overwrite overwrite = {address, bytes,           site,          space,
                                      {},      conflict.stored, conflict.other};
  const bool both_store = access == Access::store && conflict.is_with_store;
  if (both_store && bytes <= static_cast<int32_t>(sizeof overwrite.before)) {
    std::memcpy(overwrite.before, address, static_cast<size_t>(bytes));
    thread.overwrite = overwrite;
    return;
  }
  report_race(thread, address, space, site, verb_of(access), conflict.other, conflict.other_did);
}

// Called once the store has happened.
void Executor::check_overwrite(ThreadState& thread) {
  if (!thread.overwrite) return;
  const ThreadState::Overwrite store = *thread.overwrite;
  thread.overwrite.reset();
  bool changes = false;
  for (int32_t i = 0; i < store.bytes; ++i)
    changes |= (store.by_others >> i & 1) && store.before[i] != store.address[i];
  if (!changes) return;
  report_race(thread, store.address, store.space, store.site, "store", store.other, "store");
}

void Executor::report_race(const ThreadState& thread, const void* address, int32_t space,
                           int32_t site, const char* did, const Moment& other,
                           const char* other_did) {
  fail_in_kernel(launch_failed, "accesses of two threads must be ordered where one stores: " +
                                    place_of(address, space) + " has a " + other_did + " by " +
                                    name_of(other) + statement(other.site) +
                                    ", and with no barrier between them a " + did + " by " +
                                    name_of(thread) + statement(site));
}

}  // namespace retrograde::simt
