// A folder that, with all its files, belongs to the user alone (mode 0700).
//
// All operations are relative to the open folder that was checked, even if its path later names another one. Symbolic
// links are not followed.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace retrograde::jit {

// An open file descriptor, closed on destruction.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor();
  bool valid() const { return fd_ >= 0; }
  int get() const { return fd_; }

 private:
  int fd_;
};

struct FileInFolder {
  std::string name;
  int64_t bytes = 0;
  int64_t used = 0;  // last written or touched, in nanoseconds since 1970
};

class PrivateFolder {
 public:
  // Creates the folder if it is missing. If that fails, or the folder is not private to the user, throws CompileError
  // that says `asked` cannot be done.
  PrivateFolder(const std::string& path, const std::string& asked);

  // Nothing if the file is missing, larger than `max_bytes`, or not a plain file that only this user owns.
  std::optional<std::string> read(const std::string& name, int64_t max_bytes) const;
  bool contains(const std::string& name) const;
  void remove(const std::string& name) const;
  // Sets the file's time of last use to now.
  void touch(const std::string& name) const;
  // `replaces`: whether to overwrite an existing file of that name; if not, the existing file stays. Other processes
  // see the complete file or none; until then it is named "tmp....".
  bool write(const std::string& name, const std::string& data, bool replaces) const;

  std::vector<FileInFolder> list(const std::function<bool(const std::string&)>& takes) const;
  static int64_t bytes_of(const std::vector<FileInFolder>& files);

 private:
  Descriptor fd_;
};

}  // namespace retrograde::jit
