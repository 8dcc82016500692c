// A folder of files that belongs to the user alone (mode 0700), and everything in it too.
//
// Everything happens relative to the folder that was checked, whatever its path means later. Links
// are not followed.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace retrograde::jit {

// An open file, closed at the end.
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
  int64_t used = 0;  // when it was last written or touched: nanoseconds since 1970
};

class PrivateFolder {
 public:
  // Makes it when it is missing. CompileError, saying that `asked` cannot be done in it, when it
  // cannot be made or is not the user's own and nobody else's.
  PrivateFolder(const std::string& path, const std::string& asked);

  // Nothing when it is not there, larger than `max_bytes`, or no plain file of this user's alone.
  std::optional<std::string> read(const std::string& name, int64_t max_bytes) const;
  bool contains(const std::string& name) const;
  void remove(const std::string& name) const;
  // Says that the file was used now.
  void touch(const std::string& name) const;
  // `replaces`: takes the place of a file of that name; else it loses to one. Others see all of it
  // or nothing. Until then it is a file "tmp....".
  bool write(const std::string& name, const std::string& data, bool replaces) const;

  std::vector<FileInFolder> list(const std::function<bool(const std::string&)>& takes) const;
  static int64_t bytes_of(const std::vector<FileInFolder>& files);

 private:
  Descriptor fd_;
};

}  // namespace retrograde::jit
