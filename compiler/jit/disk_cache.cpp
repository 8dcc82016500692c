#include "jit/disk_cache.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <llvm/ADT/ArrayRef.h>
#include <llvm/Config/llvm-config.h>
#include <llvm/Support/SHA256.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <mutex>

#include "codegen/machine.h"
#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "frontend/compile_cache.h"
#include "jit/fingerprint.h"

namespace retrograde::jit {
namespace {

using Bytes = std::string;
constexpr size_t digest_bytes = 32;
constexpr char magic[] = "RGCACHE1";
constexpr off_t max_entry_bytes = off_t{256} << 20;

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

// ---- files ----

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  bool valid() const { return fd_ >= 0; }
  int get() const { return fd_; }

 private:
  int fd_;
};

bool is_private(const struct stat& status) {
  return status.st_uid == geteuid() && (status.st_mode & 077) == 0;
}

bool write_all(int fd, const Bytes& data) {
  size_t done = 0;
  while (done < data.size()) {
    const ssize_t written = write(fd, data.data() + done, data.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    done += static_cast<size_t>(written);
  }
  return true;
}

std::optional<Bytes> read_all(int fd, size_t size) {
  Bytes data(size, 0);
  size_t done = 0;
  while (done < size) {
    const ssize_t got = read(fd, data.data() + done, size - done);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return std::nullopt;
    done += static_cast<size_t>(got);
  }
  return data;
}

// Everything happens relative to the folder that was checked, whatever its path means later.
class Folder {
 public:
  explicit Folder(const std::string& path) : fd_(open_checked(path)) {}

  // Nothing when it is not there, and when it is no plain file of this user's alone.
  std::optional<Bytes> read(const std::string& name) const {
    const Descriptor file(openat(fd_.get(), name.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
    struct stat status;
    if (!file.valid() || fstat(file.get(), &status) != 0) return std::nullopt;
    if (!S_ISREG(status.st_mode) || !is_private(status)) return std::nullopt;
    if (status.st_size > max_entry_bytes) return std::nullopt;
    return read_all(file.get(), static_cast<size_t>(status.st_size));
  }

  bool contains(const std::string& name) const {
    struct stat status;
    return fstatat(fd_.get(), name.c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0;
  }

  void remove(const std::string& name) const { unlinkat(fd_.get(), name.c_str(), 0); }

  // `replaces`: takes the place of a file of that name; else it loses to one.
  bool write(const std::string& name, const Bytes& data, bool replaces) const {
    static std::atomic<uint64_t> counter{0};
    const std::string temporary =
        "tmp." + std::to_string(getpid()) + "." + std::to_string(counter++);
    const int flags = O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC;
    bool written = false;
    {
      const Descriptor file(openat(fd_.get(), temporary.c_str(), flags, 0600));
      if (!file.valid()) return false;
      written = write_all(file.get(), data);
    }
    if (written && replaces)
      written = renameat(fd_.get(), temporary.c_str(), fd_.get(), name.c_str()) == 0;
    if (written && !replaces)
      written = linkat(fd_.get(), temporary.c_str(), fd_.get(), name.c_str(), 0) == 0;
    if (!written || !replaces) remove(temporary);
    return written;
  }

 private:
  Descriptor fd_;

  [[noreturn]] static void refuse(const std::string& path, const std::string& evidence) {
    user_error("keep compiled code in " + quoted(path),
               "its folder belongs to the user alone (mode 0700)", evidence,
               "Name another folder, or make this one private: chmod 700");
  }

  static int open_checked(const std::string& path) {
    if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST)
      refuse(path, std::string("it cannot be made: ") + std::strerror(errno));
    const int fd = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0) refuse(path, std::string("it cannot be opened: ") + std::strerror(errno));
    struct stat status;
    const bool is_known = fstat(fd, &status) == 0;
    if (is_known && is_private(status)) return fd;
    close(fd);
    if (!is_known) refuse(path, "its owner cannot be found");
    if (status.st_uid != geteuid()) refuse(path, "it belongs to another user");
    refuse(path, "others can read or write it");
  }
};

// The key of the folder's MACs, made by whoever comes first.
Bytes folder_key(const Folder& folder) {
  for (int attempt = 0; attempt < 3; attempt++) {
    const std::optional<Bytes> found = folder.read("key");
    if (found && found->size() == digest_bytes) return *found;
    if (folder.contains("key")) folder.remove("key");  // not as it was written
    Bytes fresh(digest_bytes, 0);
    if (getrandom(fresh.data(), fresh.size(), 0) != static_cast<ssize_t>(fresh.size())) break;
    folder.write("key", fresh, false);
  }
  user_error("keep compiled code on disk", "its folder must be writable",
             "the key of its entries cannot be written there", "Name another folder");
}

// ---- entries: magic, key, name, object, MAC of all that ----

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
  explicit FolderCache(const std::string& path) : folder_(path), mac_key_(folder_key(folder_)) {}

  std::optional<CachedObject> find(const std::string& key) override {
    const std::optional<Bytes> data = folder_.read(key);
    std::optional<CachedObject> entry;
    if (data && data->size() > digest_bytes) {
      const Bytes content = data->substr(0, data->size() - digest_bytes);
      if (hmac(mac_key_, content) == data->substr(content.size())) entry = unpack(key, content);
    }
    if (entry) {
      hits_++;
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
    const Bytes content = pack(key, object);
    if (folder_.write(key, content + hmac(mac_key_, content), true)) written_++;
  }

  DiskCacheStatistics statistics() const override { return {hits_, misses_, rejected_, written_}; }

 private:
  const Folder folder_;
  const Bytes mac_key_;
  std::atomic<size_t> hits_{0}, misses_{0}, rejected_{0}, written_{0};
};

// ---- what machine code depends on ----

// Another build of the compiler is another file.
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

std::shared_ptr<DiskCache> open_disk_cache(const std::string& folder) {
  return std::make_shared<FolderCache>(folder);
}

std::shared_ptr<DiskCache> disk_cache() {
  Configuration& now = configuration();
  const std::lock_guard lock(now.mutex);
  if (!now.environment_was_read) {
    const char* folder = std::getenv("RETROGRADE_CACHE_DIR");
    if (folder && *folder) now.cache = open_disk_cache(folder);
    now.environment_was_read = true;
  }
  return now.cache;
}

std::string disk_cache_key(const ir::LoweredFunction& function, const codegen::Options& options) {
  const codegen::Machine machine = codegen::machine_for(options.target, options.tune_for_host);
  Bytes content = compiler_build();
  for (const std::string& part : {options.target.to_string(), machine.triple, machine.cpu,
                                  machine.tune_cpu, machine.features})
    content += number(part.size()) + part;
  content += number(static_cast<uint64_t>(options.optimization_level));
  run_on_large_stack([&] { content += fingerprint_text(function); });
  std::string digits;
  for (const char byte : sha256(content)) {
    const char* const hex = "0123456789abcdef";
    digits += hex[static_cast<uint8_t>(byte) >> 4];
    digits += hex[static_cast<uint8_t>(byte) & 15];
  }
  return digits;
}

}  // namespace retrograde::jit

namespace retrograde {

void set_compile_cache_directory(const std::string& folder) {
  auto cache = folder.empty() ? nullptr : jit::open_disk_cache(folder);
  jit::Configuration& now = jit::configuration();
  const std::lock_guard lock(now.mutex);
  now.environment_was_read = true;
  now.cache = std::move(cache);
}

}  // namespace retrograde
