#include "database.h"

#include <sqlite3.h>

#include "diagnostics/error.h"
#include "diagnostics/text_hash.h"

namespace retrograde::tune {

namespace {

constexpr int64_t our_mark = 0x72677475;  // "rgtu", the application_id of our files
constexpr int64_t tables_version = 1;
constexpr int busy_ms = 10000;
const char* const version = RETROGRADE_VERSION;

const char* const tables = R"(
  begin immediate;
  create table machine (id integer primary key, name text not null unique);
  create table program (id integer primary key, hash text not null unique, name text not null,
                        text text not null);
  create table candidate (id integer primary key, program integer not null references program,
                          log text not null, graph text not null, unique (program, log));
  create table measurement (candidate integer not null references candidate,
                            machine integer not null references machine,
                            threads integer not null, version text not null,
                            seconds real, runs integer not null, predicted_seconds real not null,
                            error text not null, measured_at text not null default current_timestamp,
                            primary key (candidate, machine, threads, version));
  pragma application_id = 1919382645;
  pragma user_version = 1;
  commit;
)";

std::string hash_of(const std::string& text) {
  return std::to_string(text_hash(text)) + "-" + std::to_string(text.size());
}

}  // namespace

// An SQL statement: values are bound in order, then rows are read.
class Statement {
 public:
  Statement(Database& database, const char* sql) : database_(database) {
    if (sqlite3_prepare_v2(database.handle_, sql, -1, &statement_, nullptr) != SQLITE_OK) fail();
  }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;
  ~Statement() { sqlite3_finalize(statement_); }

  Statement& with(int64_t value) {
    sqlite3_bind_int64(statement_, ++bound_, value);
    return *this;
  }
  Statement& with(double value) {
    sqlite3_bind_double(statement_, ++bound_, value);
    return *this;
  }
  Statement& with(const std::string& value) {
    sqlite3_bind_text(statement_, ++bound_, value.data(), static_cast<int>(value.size()),
                      SQLITE_TRANSIENT);
    return *this;
  }
  // Advances to the next row; returns false if there is none.
  bool next() {
    const int code = sqlite3_step(statement_);
    if (code != SQLITE_ROW && code != SQLITE_DONE) fail();
    return code == SQLITE_ROW;
  }
  int64_t integer(int column) { return sqlite3_column_int64(statement_, column); }
  double real(int column) { return sqlite3_column_double(statement_, column); }
  std::string text(int column) {
    const unsigned char* value = sqlite3_column_text(statement_, column);
    return value ? reinterpret_cast<const char*>(value) : "";
  }

 private:
  Database& database_;
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;

  [[noreturn]] void fail() const {
    database_.fail(sqlite3_errmsg(database_.handle_), "Name another file, or remove this one");
  }
};

Database::Database(const std::string& path) : path_(path) {
  const int code = sqlite3_open(path.c_str(), &handle_);
  try {
    if (code != SQLITE_OK) fail(sqlite3_errmsg(handle_), "Name a file that can be written");
    sqlite3_busy_timeout(handle_, busy_ms);
    check_kind();
    run("pragma foreign_keys = on");
  } catch (...) {
    sqlite3_close(handle_);
    throw;
  }
}

Database::~Database() { sqlite3_close(handle_); }

void Database::fail(const std::string& evidence, const std::string& instead) const {
  user_error("use " + retrograde::quoted(path_) + " for measurements",
             "the file is a database of tools/tune, of this version", evidence, instead);
}

void Database::run(const char* sql) {
  if (sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr) != SQLITE_OK)
    fail(sqlite3_errmsg(handle_), "Name another file, or remove this one");
}

int64_t Database::number(const char* sql) {
  Statement statement(*this, sql);
  return statement.next() ? statement.integer(0) : 0;
}

// Checks that the file is ours; other files are not changed.
void Database::check_kind() {
  const bool is_empty = number("select count(*) from sqlite_master") == 0;
  if (is_empty && number("pragma application_id") == 0) return run(tables);
  if (number("pragma application_id") != our_mark)
    fail("it is a database of something else", "Name another file");
  if (number("pragma user_version") != tables_version)
    fail("it is of another version", "Name another file");
}

int64_t Database::machine(const std::string& name) {
  Statement(*this, "insert or ignore into machine (name) values (?)").with(name).next();
  Statement found(*this, "select id from machine where name = ?");
  found.with(name).next();
  return found.integer(0);
}

int64_t Database::program(const std::string& name, const std::string& text) {
  const std::string hash = hash_of(text);
  Statement(*this, "insert or ignore into program (hash, name, text) values (?, ?, ?)")
      .with(hash)
      .with(name)
      .with(text)
      .next();
  Statement found(*this, "select id from program where hash = ?");
  found.with(hash).next();
  return found.integer(0);
}

int64_t Database::candidate(int64_t program, const std::string& log, const std::string& graph) {
  Statement(*this, "insert or ignore into candidate (program, log, graph) values (?, ?, ?)")
      .with(program)
      .with(log)
      .with(graph)
      .next();
  Statement found(*this, "select id from candidate where program = ? and log = ?");
  found.with(program).with(log).next();
  return found.integer(0);
}

std::optional<Measurement> Database::measurement(int64_t candidate, int64_t machine, int threads) {
  Statement found(*this,
                  "select seconds, runs, predicted_seconds, error from measurement where "
                  "candidate = ? and machine = ? and threads = ? and version = ?");
  found.with(candidate).with(machine).with(int64_t{threads}).with(std::string(version));
  if (!found.next()) return std::nullopt;
  return Measurement{found.real(0), static_cast<int>(found.integer(1)), found.real(2),
                     found.text(3)};
}

void Database::keep(int64_t candidate, int64_t machine, int threads,
                    const Measurement& measurement) {
  Statement(*this,
            "insert or replace into measurement (candidate, machine, threads, version, seconds, "
            "runs, predicted_seconds, error) values (?, ?, ?, ?, ?, ?, ?, ?)")
      .with(candidate)
      .with(machine)
      .with(int64_t{threads})
      .with(std::string(version))
      .with(measurement.seconds)
      .with(int64_t{measurement.runs})
      .with(measurement.predicted_seconds)
      .with(measurement.error)
      .next();
}

std::vector<Measured> Database::measured(int64_t machine, int threads) {
  Statement rows(*this,
                 "select p.id, p.name, c.log, c.graph, m.seconds, m.runs, m.predicted_seconds "
                 "from measurement m join candidate c on c.id = m.candidate "
                 "join program p on p.id = c.program where m.machine = ? and m.threads = ? and "
                 "m.version = ? and m.error = '' order by p.id, m.seconds, c.id");
  rows.with(machine).with(int64_t{threads}).with(std::string(version));
  std::vector<Measured> result;
  while (rows.next()) {
    result.push_back({rows.integer(0),
                      rows.text(1),
                      rows.text(2),
                      rows.text(3),
                      {rows.real(4), static_cast<int>(rows.integer(5)), rows.real(6), ""}});
  }
  return result;
}

}  // namespace retrograde::tune
