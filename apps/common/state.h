// state.h -- saves a run so that it can continue later: the file behind --resume.
//
//   apps::State state{.program = "lens", .step = 120};
//   state.arrays["curvatures"] = values;      // doubles hold floats exactly
//   adam.save(state, "adam");
//   apps::write_state(folder / "state.bin", state);
//
// One binary file, written atomically: magic, version, program, step, words, named arrays, and a CRC-32 of everything.
// A file that is damaged, truncated, from another program or no state at all gives a one-line UserError and is not
// used.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace apps {

struct State {
  std::string program;
  int64_t step = 0;
  double seconds = 0;                             // total time of the steps so far
  std::map<std::string, std::string> words = {};  // names of methods, random generators ...
  std::map<std::string, std::vector<double>> arrays = {};

  // The array of that name and size. Throws retrograde::UserError if there is none.
  const std::vector<double>& array(const std::string& name, size_t size) const;
  void put(const std::string& name, std::span<const float> values);
  void get(const std::string& name, std::span<float> values) const;

  void put(const std::string& name, const std::mt19937_64& random);
  void get(const std::string& name, std::mt19937_64& random) const;
};

// Throws retrograde::UserError unless the state is that of a run on this problem: `problem` is a description, which
// words["problem"] has, of what must be the same, and `kind` names it in the message.
void require_same_problem(const std::filesystem::path& path, const State& state,
                          const std::string& problem, const std::string& kind);

void write_state(const std::filesystem::path& path, const State& state);

// Throws retrograde::UserError unless the file is a complete state of this program.
State read_state(const std::filesystem::path& path, const std::string& program);

}  // namespace apps
