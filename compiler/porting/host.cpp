#include "porting/host.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>

namespace retrograde::porting {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void refuse(const std::string& asked, const std::string& name,
                         const std::string& evidence) {
  user_error(asked + " " + retrograde::quoted(name), "the file system allows it", evidence,
             "Look at the path and its rights");
}

void remove_at(const std::string& name) {
  std::error_code error;
  if (!fs::remove(name, error))
    refuse("remove", name, error ? error.message() : "it does not exist");
}

std::string temporary_pattern(const std::string& prefix, const std::string& suffix) {
  return (fs::temp_directory_path() / (prefix + "XXXXXX" + suffix)).string();
}

}  // namespace

bool file_exists(const std::string& name) {
  std::error_code error;
  return fs::exists(name, error);
}

void assert_file_exists(const std::string& name) {
  if (file_exists(name)) return;
  user_error("go on without the file " + retrograde::quoted(name), "the file exists", "it does not",
             "Write it first");
}

void assert_no_file_exists(const std::string& name) {
  if (!file_exists(name)) return;
  user_error("go on with the file " + retrograde::quoted(name), "the file does not exist",
             "it does", "Remove it first");
}

void ensure_no_file_exists(const std::string& name) {
  if (file_exists(name)) remove_at(name);
}

void file_unlink(const std::string& name) { remove_at(name); }
void dir_rmdir(const std::string& name) { remove_at(name); }

std::string file_make_temp(const std::string& prefix, const std::string& suffix) {
  std::string name = temporary_pattern(prefix, suffix);
  const int file = mkstemps(name.data(), static_cast<int>(suffix.size()));
  if (file < 0) refuse("make a temporary file", name, "it cannot be made");
  close(file);
  return name;
}

std::string dir_make_temp() {
  std::string name = temporary_pattern("", "");
  if (!mkdtemp(name.data())) refuse("make a temporary folder", name, "it cannot be made");
  return name;
}

std::vector<char> read_entire_file(const std::string& name) {
  std::ifstream file(name, std::ios::binary);
  if (!file) refuse("read", name, "it cannot be opened");
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_entire_file(const std::string& name, const void* data, size_t bytes) {
  std::ofstream file(name, std::ios::binary | std::ios::trunc);
  file.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
  if (!file.flush()) refuse("write", name, "it cannot be written");
}

std::string get_env_variable(const char* name) {
  const char* value = name ? std::getenv(name) : nullptr;
  return value ? value : "";
}

int get_llvm_version() { return RETROGRADE_LLVM_VERSION; }

bool starts_with(const std::string& text, const std::string& prefix) {
  return text.starts_with(prefix);
}
bool ends_with(const std::string& text, const std::string& suffix) {
  return text.ends_with(suffix);
}

std::string replace_all(const std::string& text, const std::string& find,
                        const std::string& replacement) {
  if (find.empty()) return text;
  std::string result;
  size_t from = 0;
  for (size_t at; (at = text.find(find, from)) != std::string::npos; from = at + find.size())
    result += text.substr(from, at - from) + replacement;
  return result + text.substr(from);
}

std::vector<std::string> split_string(const std::string& text, const std::string& delimiter) {
  std::vector<std::string> parts;
  size_t from = 0;
  for (size_t at; !delimiter.empty() && (at = text.find(delimiter, from)) != std::string::npos;
       from = at + delimiter.size())
    parts.push_back(text.substr(from, at - from));
  parts.push_back(text.substr(from));
  return parts;
}

int64_t gcd(int64_t a, int64_t b) { return std::gcd(a, b); }
int64_t lcm(int64_t a, int64_t b) { return std::lcm(a, b); }

namespace {

bool fits(int bits, __int128 value) {
  const __int128 half = static_cast<__int128>(1) << (bits - 1);
  return value >= -half && value < half;
}

}  // namespace

bool add_would_overflow(int bits, int64_t a, int64_t b) {
  return !fits(bits, static_cast<__int128>(a) + b);
}
bool sub_would_overflow(int bits, int64_t a, int64_t b) {
  return !fits(bits, static_cast<__int128>(a) - b);
}
bool mul_would_overflow(int bits, int64_t a, int64_t b) {
  return !fits(bits, static_cast<__int128>(a) * b);
}

}  // namespace retrograde::porting
