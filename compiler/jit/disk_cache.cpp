#include "jit/disk_cache.h"

#include <dlfcn.h>
#include <llvm/ADT/ArrayRef.h>
#include <llvm/Config/llvm-config.h>
#include <llvm/Support/SHA256.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <tuple>

#include "codegen/llvm/machine.h"
#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "frontend/run/compile_cache.h"
#include "jit/fingerprint.h"
#include "jit/private_folder.h"

namespace retrograde::jit {
namespace {

using Bytes = std::string;
constexpr size_t digest_bytes = 32;
constexpr char magic[] = "RGCACHE1";
constexpr int64_t max_entry_bytes = int64_t{256} << 20;
constexpr size_t key_digits = 64;

Bytes sha256(const Bytes& data) {
  const auto digest = llvm::SHA256::hash(
      llvm::ArrayRef<uint8_t>(reinterpret_cast<const uint8_t*>(data.data()), data.size()));
  return {digest.begin(), digest.end()};
}

Bytes hmac(const Bytes& key, const Bytes& data) {
  Bytes inner(64, '\x36'), outer(64, '\x5c');
  for (size_t i = 0; i < key.size(); i++) {
    inner[i] = static_cast<char>(inner[i] ^ key[i]);
    outer[i] = static_cast<char>(outer[i] ^ key[i]);
  }
  return sha256(outer + sha256(inner + data));
}

Bytes number(uint64_t value) { return {reinterpret_cast<const char*>(&value), sizeof value}; }

// The key of the folder's MACs. The first process to use the folder creates it.
Bytes folder_key(const PrivateFolder& folder) {
  for (int attempt = 0; attempt < 3; attempt++) {
    const std::optional<Bytes> found = folder.read("key", max_entry_bytes);
    if (found && found->size() == digest_bytes) return *found;
    if (folder.contains("key")) folder.remove("key");  // damaged
    Bytes fresh(digest_bytes, 0);
    if (getrandom(fresh.data(), fresh.size(), 0) != static_cast<ssize_t>(fresh.size())) break;
    folder.write("key", fresh, false);
  }
  user_error("keep compiled code on disk", "its folder must be writable",
             "the key of its entries cannot be written there", "Name another folder");
}

// ---- entries: magic, key, name, object, and a MAC over all of these ----

Bytes pack(const std::string& key, const CachedObject& entry) {
  return magic + key + number(entry.function.size()) + entry.function +
         number(entry.object.size()) + Bytes(entry.object.begin(), entry.object.end());
}

class Reader {
 public:
  explicit Reader(const Bytes& data) : data_(data) {}
  Bytes take(size_t size) {
    if (size > data_.size() - position_) {
      failed = true;
      return {};
    }
    position_ += size;
    return data_.substr(position_ - size, size);
  }
  Bytes take_sized() {
    const Bytes size = take(sizeof(uint64_t));
    uint64_t value = 0;
    if (!failed) std::memcpy(&value, size.data(), sizeof value);
    return take(value);
  }
  bool at_end() const { return position_ == data_.size(); }
  bool failed = false;

 private:
  const Bytes& data_;
  size_t position_ = 0;
};

std::optional<CachedObject> unpack(const std::string& key, const Bytes& data) {
  Reader reader(data);
  if (reader.take(sizeof magic - 1) != magic || reader.take(key.size()) != key) return std::nullopt;
  CachedObject entry;
  entry.function = reader.take_sized();
  const Bytes object = reader.take_sized();
  if (reader.failed || !reader.at_end()) return std::nullopt;
  entry.object.assign(object.begin(), object.end());
  return entry;
}

class FolderCache : public DiskCache {
 public:
  FolderCache(const std::string& path, int64_t max_bytes)
      : folder_(path, "keep compiled code"),
        mac_key_(folder_key(folder_)),
        max_bytes_(max_bytes),
        held_(folder_.bytes_of(list())) {}

  std::optional<CachedObject> find(const std::string& key) override {
    const std::optional<Bytes> data = folder_.read(key, max_entry_bytes);
    std::optional<CachedObject> entry;
    if (data && data->size() > digest_bytes) {
      const Bytes content = data->substr(0, data->size() - digest_bytes);
      if (hmac(mac_key_, content) == data->substr(content.size())) entry = unpack(key, content);
    }
    if (entry) {
      hits_++;
      folder_.touch(key);
      return entry;
    }
    misses_++;
    if (folder_.contains(key)) {
      rejected_++;
      folder_.remove(key);
    }
    return std::nullopt;
  }

  void insert(const std::string& key, const CachedObject& object) override {
    const Bytes content = pack(key, object), entry = content + hmac(mac_key_, content);
    const auto bytes = static_cast<int64_t>(entry.size());
    if (bytes > std::min(max_bytes_, max_entry_bytes) || !folder_.write(key, entry, true)) return;
    written_++;
    const std::lock_guard lock(mutex_);
    held_ += bytes;
    if (held_ > max_bytes_) shrink();
  }

  DiskCacheStatistics statistics() const override {
    return {hits_, misses_, rejected_, written_, removed_};
  }

 private:
  // Reads the folder, because other processes may add and remove files at the same time.
  std::vector<FileInFolder> list() const {
    return folder_.list([](const std::string& name) {
      const bool is_left_over = name.compare(0, 4, "tmp.") == 0;
      return is_left_over || name.size() == key_digits;
    });
  }

  // Removes the least recently used entries, down to nine tenths of the limit, so that it happens rarely.
  void shrink() {
    std::vector<FileInFolder> files = list();
    std::sort(files.begin(), files.end(), [](const FileInFolder& a, const FileInFolder& b) {
      return std::tie(a.used, a.name) < std::tie(b.used, b.name);
    });
    held_ = folder_.bytes_of(files);
    for (const FileInFolder& file : files) {
      if (held_ <= max_bytes_ / 10 * 9) break;
      folder_.remove(file.name);
      held_ -= file.bytes;
      removed_++;
    }
  }

  const PrivateFolder folder_;
  const Bytes mac_key_;
  const int64_t max_bytes_;
  std::mutex mutex_;
  int64_t held_;  // according to this process
  std::atomic<size_t> hits_{0}, misses_{0}, rejected_{0}, written_{0}, removed_{0};
};

// ---- inputs of the key ----

// Another build of the compiler is a different file, so the file's identity is part of the key.
Bytes compiler_build() {
  static const Bytes build = [] {
    Dl_info info;
    struct stat status = {};
    if (dladdr(magic, &info) != 0 && info.dli_fname) stat(info.dli_fname, &status);
    return number(static_cast<uint64_t>(status.st_size)) +
           number(static_cast<uint64_t>(status.st_mtim.tv_sec)) +
           number(static_cast<uint64_t>(status.st_mtim.tv_nsec)) + LLVM_VERSION_STRING;
  }();
  return build;
}

// In millions of bytes.
int64_t bytes_from_environment() {
  const char* text = std::getenv("RETROGRADE_CACHE_MB");
  if (!text || !*text) return default_compile_cache_bytes;
  int64_t value = 0;
  const char* const end = text + std::strlen(text);
  const auto parsed = std::from_chars(text, end, value);
  if (parsed.ec == std::errc() && parsed.ptr == end && value > 0 && value <= int64_t{1} << 30)
    return value * 1000000;
  user_error("keep compiled code on disk",
             "RETROGRADE_CACHE_MB is a whole number of megabytes, 1 or more",
             "it is " + quoted(text), "Set it so, or leave it unset");
}

struct Configuration {
  std::mutex mutex;
  bool environment_was_read = false;
  std::shared_ptr<DiskCache> cache;
};

Configuration& configuration() {
  static Configuration& instance = *new Configuration;
  return instance;
}

}  // namespace

std::shared_ptr<DiskCache> open_disk_cache(const std::string& folder, int64_t max_bytes) {
  if (max_bytes <= 0) {
    user_error("keep compiled code in " + quoted(folder), "its size in bytes is positive",
               "it is " + std::to_string(max_bytes), "Give the bytes that it may take");
  }
  return std::make_shared<FolderCache>(folder, max_bytes);
}

std::shared_ptr<DiskCache> disk_cache() {
  Configuration& now = configuration();
  const std::lock_guard lock(now.mutex);
  if (!now.environment_was_read) {
    const char* folder = std::getenv("RETROGRADE_CACHE_DIR");
    if (folder && *folder) now.cache = open_disk_cache(folder, bytes_from_environment());
    now.environment_was_read = true;
  }
  return now.cache;
}

static Bytes sized(const Bytes& part) { return number(part.size()) + part; }

static std::string hexadecimal(const Bytes& bytes) {
  std::string digits;
  for (const char byte : bytes) {
    const char* const hex = "0123456789abcdef";
    digits += hex[static_cast<uint8_t>(byte) >> 4];
    digits += hex[static_cast<uint8_t>(byte) & 15];
  }
  return digits;
}

std::string content_key(const std::vector<std::string>& parts) {
  Bytes content;
  for (const std::string& part : parts) content += sized(part);
  return hexadecimal(sha256(content));
}

std::string disk_cache_key(const ir::LoweredFunction& function, const codegen::Options& options) {
  const codegen::Machine machine = codegen::machine_for(options.target, options.tune_for_host);
  Bytes content = compiler_build();
  for (const std::string& part : {options.target.to_string(), machine.triple, machine.cpu,
                                  machine.tune_cpu, machine.features})
    content += sized(part);
  content += number(static_cast<uint64_t>(options.optimization_level));
  content += number(static_cast<uint64_t>(options.kernels_for_executor));
  run_on_large_stack([&] { content += fingerprint_text(function); });
  return hexadecimal(sha256(content));
}

}  // namespace retrograde::jit

namespace retrograde {

void set_compile_cache_directory(const std::string& folder, int64_t max_bytes) {
  auto cache = folder.empty() ? nullptr : jit::open_disk_cache(folder, max_bytes);
  jit::Configuration& now = jit::configuration();
  const std::lock_guard lock(now.mutex);
  now.environment_was_read = true;
  now.cache = std::move(cache);
}

}  // namespace retrograde
