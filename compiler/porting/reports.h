// reports.h -- messages composed with <<, as user_assert and the like in Halide programs need; and
// handlers of warnings and errors.
#pragma once

#include <sstream>
#include <string>

namespace retrograde::porting {

// Collects a message until its full expression ends. Then it throws CompileError, or InternalError
// for a bug of the library; a warning is reported.
class ErrorReport {
 public:
  enum class Kind { User, Internal, Warning };
  ErrorReport(const char* file, int line, const char* condition, Kind kind);
  ~ErrorReport() noexcept(false);
  ErrorReport(const ErrorReport&) = delete;
  ErrorReport& operator=(const ErrorReport&) = delete;

  template <typename T>
  ErrorReport& operator<<(const T& part) {
    text_ << part;
    return *this;
  }
  ErrorReport& ref() { return *this; }

 private:
  const Kind kind_;
  const int exceptions_;  // exceptions in flight at construction: none is thrown on top of them
  std::string asked_;
  std::ostringstream text_;
};

// Binds weaker than << and tighter than ?:, so the report of a true condition is never constructed.
struct Voidifier {
  void operator&(ErrorReport&) const {}
};

// Writes "Warning: <text>" to standard error. Performance notes are not warnings.
void print_warning(const std::string& warning);
// Prints the warnings for which no handler is set.
bool print_warnings_by_default();

// Receives errors before they are thrown, and warnings instead of their being printed.
class CompileTimeErrorReporter {
 public:
  virtual ~CompileTimeErrorReporter() = default;
  virtual void warning(const char* text) = 0;
  virtual void error(const char* text) = 0;  // when it returns, the error is thrown
};
// Null: no reporter; warnings are printed.
void set_custom_compile_time_error_reporter(CompileTimeErrorReporter* reporter);

}  // namespace retrograde::porting
