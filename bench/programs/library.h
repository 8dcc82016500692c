// library.h -- one program compiled ahead of time by one side, as a library that a worker loads.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "../pairs/worker.h"

namespace programs {

// The program does not compile; contains the compiler's message.
struct BuildError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Library {
  std::filesystem::path path, cases;
  double compile_ms = 0, compile_peak_mb = 0;
};

// The files of one side: its builder, its runtime, the folder of its libraries.
class Toolchain {
 public:
  // `programs`: the folder of the builders. `folder` is created.
  Toolchain(bench::Side side, const std::filesystem::path& programs,
            const std::filesystem::path& folder);

  // With `reuse`, uses the library of an earlier run if there is one. Throws BuildError.
  Library build(const std::string& name, bool reuse) const;
  // For gradients: the program itself, with the same function name.
  Library build_primal(const std::string& name, bool reuse) const;

 private:
  Library read(const std::string& name) const;
  void link(const std::string& name, const std::filesystem::path& runtime) const;
  std::filesystem::path file(const std::string& name, const std::string& extension) const {
    return folder_ / (name + extension);
  }

  bench::Side side_;
  std::filesystem::path builder_, folder_;
};

}  // namespace programs
