#include "aot/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "diagnostics/error.h"

namespace retrograde::aot {
namespace {

[[noreturn]] void cannot_write(const std::string& path, int error) {
  user_error("write " + quoted(path), "an output file's folder must exist and be writable",
             std::string("the system says: ") + std::strerror(error),
             "Give a path that can be written");
}

// A temporary file beside `path`. It is deleted unless it is moved to its final name.
class Temporary {
 public:
  explicit Temporary(const File& file) : path_(file.path), name_(file.path + ".XXXXXX") {
    const int descriptor = mkstemp(name_.data());
    if (descriptor < 0) {
      name_.clear();
      cannot_write(path_, errno);
    }
    const int error = fill(descriptor, file.contents);
    if (close(descriptor) != 0 || error != 0) {
      const int reason = error ? error : errno;
      remove();
      cannot_write(path_, reason);
    }
  }
  Temporary(Temporary&& other) noexcept
      : path_(std::move(other.path_)), name_(std::exchange(other.name_, {})) {}
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  ~Temporary() { remove(); }

  void move_to_place() {
    if (std::rename(name_.c_str(), path_.c_str()) != 0) cannot_write(path_, errno);
    name_.clear();
  }

 private:
  std::string path_, name_;

  void remove() {
    if (!name_.empty()) unlink(name_.c_str());
    name_.clear();
  }

  // Returns 0 or the system's error code. The file gets the permissions of a normally created file, because mkstemp
  // makes it private.
  static int fill(int descriptor, const std::string& contents) {
    const mode_t mask = umask(0);
    umask(mask);
    if (fchmod(descriptor, 0666 & ~mask) != 0) return errno;
    size_t done = 0;
    while (done < contents.size()) {
      const ssize_t written = write(descriptor, contents.data() + done, contents.size() - done);
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return errno;
      done += static_cast<size_t>(written);
    }
    return 0;
  }
};

bool is_folder(const std::string& path) {
  struct stat status;
  return stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
}

}  // namespace

void write_files(const std::vector<File>& files) {
  for (const File& file : files) {
    if (is_folder(file.path)) cannot_write(file.path, EISDIR);
  }
  std::vector<Temporary> temporaries;
  temporaries.reserve(files.size());
  for (const File& file : files) temporaries.emplace_back(file);
  for (Temporary& temporary : temporaries) temporary.move_to_place();
}

}  // namespace retrograde::aot
