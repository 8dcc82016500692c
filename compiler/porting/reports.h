// reports.h -- messages put together with <<, for programs that bring user_assert and its kin along;
// and who is told of warnings and errors.
#pragma once

#include <sstream>
#include <string>

namespace retrograde::porting {

// Throws CompileError, or InternalError for a fault of the library, with what was written to it, when
// its full expression ends; a warning is told.
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
  const int exceptions_;  // being thrown when it was made: none is thrown on top of them
  std::string asked_;
  std::ostringstream text_;
};

// Lower than <<, higher than ?: -- so that the report of a condition that holds is never made.
struct Voidifier {
  void operator&(ErrorReport&) const {}
};

// Writes "Warning: <text>" to the standard error stream. Performance notes are no warnings.
void print_warning(const std::string& warning);
// Has warnings printed that nobody else is told of, unless a handler is set.
bool print_warnings_by_default();

// Who is told of errors before they are thrown, and of warnings in place of those who print them.
class CompileTimeErrorReporter {
 public:
  virtual ~CompileTimeErrorReporter() = default;
  virtual void warning(const char* text) = 0;
  virtual void error(const char* text) = 0;  // when it returns, the error is thrown
};
// Null: nobody, and warnings are printed.
void set_custom_compile_time_error_reporter(CompileTimeErrorReporter* reporter);

}  // namespace retrograde::porting
