// The compile cache on disk: keeps compiled functions in a folder between runs of a program. It is off until a folder
// is named (frontend/run/compile_cache.h).
//
// An entry's name is the SHA-256 of everything that the machine code depends on: the lowered function, the target and
// processor, and the build of the compiler. The folder and its files belong to the user alone. Entries are written
// under a temporary name and then renamed. Each carries a MAC (HMAC-SHA256, RFC 2104, with a key that the folder
// holds). An entry that is truncated, changed or made elsewhere is removed and compiled again; it never runs.
//
// The folder's size is limited. When it grows beyond the limit, the least recently used entries and files left by
// interrupted writers are removed.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "codegen/codegen.h"

namespace retrograde::jit {

struct DiskCacheStatistics {
  size_t hits = 0, misses = 0;
  size_t rejected = 0;  // entries that were found but damaged
  size_t written = 0;
  size_t removed = 0;  // to keep within the size limit
};

// A linkable object, and its function's name in the program that compiled it.
struct CachedObject {
  std::string function;
  std::vector<uint8_t> object;
};

class DiskCache {
 public:
  virtual ~DiskCache() = default;
  virtual std::optional<CachedObject> find(const std::string& key) = 0;
  // An entry that cannot be written, for example because the disk is full, is silently not kept.
  virtual void insert(const std::string& key, const CachedObject& object) = 0;
  virtual DiskCacheStatistics statistics() const = 0;
};

// Throws CompileError if the folder cannot be made or is not the user's own with mode 0700. Throws UserError if the
// size is not positive.
std::shared_ptr<DiskCache> open_disk_cache(const std::string& folder, int64_t max_bytes);
// The cache in use; null if there is none. Throws as above for the folder that the environment names.
std::shared_ptr<DiskCache> disk_cache();
// 64 hexadecimal digits.
std::string content_key(const std::vector<std::string>& parts);
std::string disk_cache_key(const ir::LoweredFunction& function, const codegen::Options& options);

}  // namespace retrograde::jit
