#include "jit/private_folder.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <memory>

#include "diagnostics/error.h"
#include "write_all.h"

namespace retrograde::jit {
namespace {

bool is_private(const struct stat& status) {
  return status.st_uid == geteuid() && (status.st_mode & 077) == 0;
}

std::optional<std::string> read_all(int fd, size_t size) {
  std::string data(size, 0);
  size_t done = 0;
  while (done < size) {
    const ssize_t got = read(fd, data.data() + done, size - done);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return std::nullopt;
    done += static_cast<size_t>(got);
  }
  return data;
}

[[noreturn]] void refuse(const std::string& asked, const std::string& path,
                         const std::string& evidence) {
  user_error(asked + " in " + quoted(path), "its folder belongs to the user alone (mode 0700)",
             evidence, "Name another folder, or make this one private: chmod 700");
}

int open_checked(const std::string& path, const std::string& asked) {
  if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST)
    refuse(asked, path, std::string("it cannot be made: ") + std::strerror(errno));
  const int fd = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (fd < 0) refuse(asked, path, std::string("it cannot be opened: ") + std::strerror(errno));
  struct stat status;
  const bool is_known = fstat(fd, &status) == 0;
  if (is_known && is_private(status)) return fd;
  close(fd);
  if (!is_known) refuse(asked, path, "its owner cannot be found");
  if (status.st_uid != geteuid()) refuse(asked, path, "it belongs to another user");
  refuse(asked, path, "others can read or write it");
}

}  // namespace

Descriptor::~Descriptor() {
  if (fd_ >= 0) close(fd_);
}

PrivateFolder::PrivateFolder(const std::string& path, const std::string& asked)
    : fd_(open_checked(path, asked)) {}

std::optional<std::string> PrivateFolder::read(const std::string& name, int64_t max_bytes) const {
  const Descriptor file(openat(fd_.get(), name.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
  struct stat status;
  if (!file.valid() || fstat(file.get(), &status) != 0) return std::nullopt;
  if (!S_ISREG(status.st_mode) || !is_private(status)) return std::nullopt;
  if (status.st_size > max_bytes) return std::nullopt;
  return read_all(file.get(), static_cast<size_t>(status.st_size));
}

bool PrivateFolder::contains(const std::string& name) const {
  struct stat status;
  return fstatat(fd_.get(), name.c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0;
}

void PrivateFolder::remove(const std::string& name) const { unlinkat(fd_.get(), name.c_str(), 0); }

void PrivateFolder::touch(const std::string& name) const {
  utimensat(fd_.get(), name.c_str(), nullptr, AT_SYMLINK_NOFOLLOW);
}

bool PrivateFolder::write(const std::string& name, const std::string& data, bool replaces) const {
  static std::atomic<uint64_t> counter{0};
  const std::string temporary = "tmp." + std::to_string(getpid()) + "." + std::to_string(counter++);
  const int flags = O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC;
  bool written = false;
  {
    const Descriptor file(openat(fd_.get(), temporary.c_str(), flags, 0600));
    if (!file.valid()) return false;
    written = runtime::write_all(file.get(), data.data(), data.size());
  }
  if (written && replaces)
    written = renameat(fd_.get(), temporary.c_str(), fd_.get(), name.c_str()) == 0;
  if (written && !replaces)
    written = linkat(fd_.get(), temporary.c_str(), fd_.get(), name.c_str(), 0) == 0;
  if (!written || !replaces) remove(temporary);
  return written;
}

std::vector<FileInFolder> PrivateFolder::list(
    const std::function<bool(const std::string&)>& takes) const {
  std::vector<FileInFolder> files;
  const int again = openat(fd_.get(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(again < 0 ? nullptr : fdopendir(again),
                                                   closedir);
  if (!folder && again >= 0) close(again);
  while (const dirent* entry = folder ? readdir(folder.get()) : nullptr) {
    struct stat status;
    if (!takes(entry->d_name)) continue;
    if (fstatat(fd_.get(), entry->d_name, &status, AT_SYMLINK_NOFOLLOW) != 0) continue;
    files.push_back({entry->d_name, status.st_size,
                     int64_t{status.st_mtim.tv_sec} * 1000000000 + status.st_mtim.tv_nsec});
  }
  return files;
}

int64_t PrivateFolder::bytes_of(const std::vector<FileInFolder>& files) {
  int64_t bytes = 0;
  for (const FileInFolder& file : files) bytes += file.bytes;
  return bytes;
}

}  // namespace retrograde::jit
