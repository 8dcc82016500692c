// database.h -- stores measurements in SQLite, so that an interrupted tuning run can continue.
//
//   machine      the processor
//   program      a graph, identified by the hash of its text
//   candidate    a schedule of a program: its log, and the scheduled graph
//   measurement  of a candidate on a machine, with a number of threads and this version of the compiler:
//                seconds, or why there are none
//
// Each measurement is a transaction of its own.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

struct sqlite3;

namespace retrograde::tune {

struct Measurement {
  double seconds = 0;
  int runs = 0;
  double predicted_seconds = 0;
  std::string error;  // not empty if it could not be compiled or run
};

// A measured candidate.
struct Measured {
  int64_t program = 0;
  std::string program_name, log, graph;
  Measurement measurement;
};

class Database {
 public:
  // Creates the file if it does not exist.
  // Requires: the file is a database of tools/tune, of this version.
  explicit Database(const std::string& path);
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  ~Database();

  // Return the row's number, after inserting it if necessary.
  int64_t machine(const std::string& name);
  int64_t program(const std::string& name, const std::string& text);
  int64_t candidate(int64_t program, const std::string& log, const std::string& graph);

  std::optional<Measurement> measurement(int64_t candidate, int64_t machine, int threads);
  void keep(int64_t candidate, int64_t machine, int threads, const Measurement& measurement);
  // Measurements with seconds, the fastest of each program first.
  std::vector<Measured> measured(int64_t machine, int threads);

 private:
  const std::string path_;
  sqlite3* handle_ = nullptr;

  [[noreturn]] void fail(const std::string& evidence, const std::string& instead) const;
  void run(const char* sql);
  int64_t number(const char* sql);
  void check_kind();
  friend class Statement;
};

}  // namespace retrograde::tune
