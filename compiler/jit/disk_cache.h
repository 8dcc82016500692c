// Compiled functions kept in a folder, from one run of a program to the next. Off until a folder is
// named (frontend/run/compile_cache.h).
//
// An entry's name is the SHA-256 of all that the machine code depends on: the lowered function, the
// target and the processor, the compiler's own build. The folder and everything in it belong to the
// user alone. Entries are written under another name and then renamed, and carry a MAC
// (HMAC-SHA256, RFC 2104, with a key that the folder keeps): one that is cut off, changed or made
// elsewhere is removed and built again; it never runs.
//
// A folder has a size that it stays within: what was not used for longest is removed when it grows
// beyond that, and so is what a writer left that did not come to its end.
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
  size_t rejected = 0;  // entries that were there and not as they were written
  size_t written = 0;
  size_t removed = 0;  // to stay within the size
};

// A linkable object and the name of its function, which is that of the program it was built for.
struct CachedObject {
  std::string function;
  std::vector<uint8_t> object;
};

class DiskCache {
 public:
  virtual ~DiskCache() = default;
  virtual std::optional<CachedObject> find(const std::string& key) = 0;
  // A full disk or the like only means that it is not kept.
  virtual void insert(const std::string& key, const CachedObject& object) = 0;
  virtual DiskCacheStatistics statistics() const = 0;
};

// CompileError when the folder cannot be made, or is not the user's own and nobody else's, and when
// the size is not positive.
std::shared_ptr<DiskCache> open_disk_cache(const std::string& folder, int64_t max_bytes);
// The one in use; null when there is none. CompileError as above for the folder that the
// environment names.
std::shared_ptr<DiskCache> disk_cache();
// 64 hexadecimal digits.
std::string content_key(const std::vector<std::string>& parts);
std::string disk_cache_key(const ir::LoweredFunction& function, const codegen::Options& options);

}  // namespace retrograde::jit
