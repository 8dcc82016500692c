// files.cpp -- see files.h.
#include "common/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <sys/stat.h>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "diagnostics/error.h"

namespace apps {

using retrograde::text;

namespace {

[[noreturn]] void refuse_write(const std::filesystem::path& path, const char* call, int error) {
  const bool full = error == ENOSPC || error == EFBIG || error == EDQUOT;
  retrograde::call_error(text("write ", retrograde::quoted(path.string())),
                         "a result is stored whole or not at all",
                         text(call, " says: ", std::strerror(error)),
                         full ? "Free some space on that disk, or give another --output"
                              : "Give a folder that you may write to");
}

// A temporary file that is deleted unless `keep` renames it to its final name.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target) : target_(target) {
    name_ = (target.parent_path() / ("." + target.filename().string() + ".XXXXXX")).string();
    descriptor_ = ::mkstemp(name_.data());
    if (descriptor_ < 0) refuse_write(target_, "creating it", errno);
    ::fchmod(descriptor_, 0644);
  }
  ~TemporaryFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!kept_) ::unlink(name_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) refuse_write(target_, "writing", errno);
      bytes.remove_prefix(static_cast<size_t>(written));
    }
  }

  void keep() {
    // Some file systems report a full disk only here.
    if (::fsync(descriptor_) != 0 && errno != EINVAL) refuse_write(target_, "flushing", errno);
    const int descriptor = std::exchange(descriptor_, -1);
    if (::close(descriptor) != 0) refuse_write(target_, "closing", errno);
    if (::rename(name_.c_str(), target_.c_str()) != 0) refuse_write(target_, "renaming", errno);
    kept_ = true;
  }

 private:
  std::filesystem::path target_;
  std::string name_;
  int descriptor_ = -1;
  bool kept_ = false;
};

}  // namespace

void write_file(const std::filesystem::path& path, std::string_view bytes) {
  TemporaryFile file(path);
  file.write(bytes);
  file.keep();
}

void require_writable_folder(const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (!std::filesystem::is_directory(folder)) {
    retrograde::call_error(text("use ", retrograde::quoted(folder.string()), " for the results"),
                           "it must be a folder, or a name where one can be made",
                           failed ? failed.message() : "something else has that name",
                           "Give another --output");
  }
  TemporaryFile trial(folder / "trial");
  trial.write("x");
}

}  // namespace apps
