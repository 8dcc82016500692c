// The cache behind memoize(): results by key, with least-recently-used eviction.
//
// Entries are immutable. A hit holds a reference to the entry and copies it to the caller's memory without the lock, so
// concurrent eviction is safe. Entries use the system's allocator, because they outlive the call whose allocator would
// account for them.
#include <cstring>
#include <list>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "retrograde_runtime.h"

namespace retrograde::runtime {
namespace {

struct Entry {
  std::string key;
  std::vector<std::vector<uint8_t>> values;  // one per value of a Tuple
  std::optional<uint64_t> eviction_key;
  int64_t bytes = 0;
};
using EntryPtr = std::shared_ptr<const Entry>;

class Cache {
 public:
  EntryPtr find(std::string_view key) {
    const std::lock_guard lock(mutex_);
    const auto found = index_.find(key);
    if (found == index_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, found->second);
    return *found->second;
  }

  void insert(EntryPtr entry) {
    const std::lock_guard lock(mutex_);
    if (entry->bytes > limit_ || index_.count(entry->key)) return;
    entries_.push_front(entry);
    try {
      index_.emplace(entry->key, entries_.begin());
    } catch (...) {
      entries_.pop_front();
      throw;
    }
    held_ += entry->bytes;
    shrink();
  }

  void evict(uint64_t eviction_key) {
    const std::lock_guard lock(mutex_);
    for (auto it = entries_.begin(); it != entries_.end();) {
      const auto next = std::next(it);
      if ((*it)->eviction_key == eviction_key) remove(it);
      it = next;
    }
  }

  void set_limit(int64_t bytes) {
    const std::lock_guard lock(mutex_);
    limit_ = bytes > 0 ? bytes : default_limit;
    shrink();
  }

  void clear() {
    const std::lock_guard lock(mutex_);
    index_.clear();
    entries_.clear();
    held_ = 0;
  }

  int64_t held() {
    const std::lock_guard lock(mutex_);
    return held_;
  }

 private:
  static constexpr int64_t default_limit = int64_t{1} << 20;
  using Entries = std::list<EntryPtr>;  // most recently used first

  void remove(Entries::iterator it) {
    held_ -= (*it)->bytes;
    index_.erase((*it)->key);
    entries_.erase(it);
  }
  void shrink() {
    while (held_ > limit_) remove(std::prev(entries_.end()));
  }

  std::mutex mutex_;
  Entries entries_;
  std::unordered_map<std::string_view, Entries::iterator> index_;  // views of the entries' keys
  int64_t held_ = 0;
  int64_t limit_ = default_limit;
};

Cache& cache() {
  static Cache& instance = *new Cache;  // never destroyed: code may run while the process exits
  return instance;
}

std::string_view view(const uint8_t* key, int32_t bytes) {
  return {reinterpret_cast<const char*>(key), static_cast<size_t>(bytes)};
}

bool fits(const Entry& entry, int32_t count, const int64_t* bytes) {
  if (entry.values.size() != static_cast<size_t>(count)) return false;
  for (int32_t i = 0; i < count; i++) {
    if (entry.values[static_cast<size_t>(i)].size() != static_cast<size_t>(bytes[i])) return false;
  }
  return true;
}

}  // namespace
}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

int32_t retrograde_memoization_lookup(retrograde_context*, const uint8_t* key, int32_t key_bytes,
                                      int32_t count, void** blocks, const int64_t* bytes) {
  const rt::EntryPtr entry = rt::cache().find(rt::view(key, key_bytes));
  if (!entry || !rt::fits(*entry, count, bytes)) return 1;
  for (int32_t i = 0; i < count; i++) {
    const std::vector<uint8_t>& value = entry->values[static_cast<size_t>(i)];
    if (!value.empty()) std::memcpy(blocks[i], value.data(), value.size());
  }
  return 0;
}

int32_t retrograde_memoization_store(retrograde_context*, const uint8_t* key, int32_t key_bytes,
                                     int32_t count, void* const* blocks, const int64_t* bytes,
                                     int32_t has_eviction_key, uint64_t eviction_key) {
  try {
    auto entry = std::make_shared<rt::Entry>();
    entry->key = rt::view(key, key_bytes);
    entry->bytes = key_bytes;
    if (has_eviction_key) entry->eviction_key = eviction_key;
    for (int32_t i = 0; i < count; i++) {
      const auto* block = static_cast<const uint8_t*>(blocks[i]);
      entry->values.emplace_back(block, block + bytes[i]);
      entry->bytes += bytes[i];
    }
    rt::cache().insert(std::move(entry));
  } catch (const std::bad_alloc&) {  // not cached; recomputed next time
  }
  return 0;
}

void retrograde_memoization_set_size(int64_t bytes) { rt::cache().set_limit(bytes); }
int64_t retrograde_memoization_bytes(void) { return rt::cache().held(); }
void retrograde_memoization_evict(uint64_t eviction_key) { rt::cache().evict(eviction_key); }
void retrograde_memoization_cleanup(void) { rt::cache().clear(); }
