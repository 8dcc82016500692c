#include "porting/reports.h"

#include <atomic>
#include <cstdio>
#include <exception>

#include "diagnostics/error.h"
#include "frontend/run/warnings.h"

namespace retrograde::porting {

ErrorReport::ErrorReport(const char* file, int line, const char* condition, Kind kind)
    : kind_(kind), exceptions_(std::uncaught_exceptions()) {
  if (condition) asked_ = text("expected ", condition, ": ");
  if (kind == Kind::Internal) asked_ += text("[", file, ":", line, "] ");
}

ErrorReport::~ErrorReport() noexcept(false) {
  const std::string message = asked_ + text_.str();
  if (kind_ == Kind::Warning) {
    frontend::tell_warning(message);
  } else if (std::uncaught_exceptions() == exceptions_) {
    if (kind_ == Kind::Internal) throw InternalError(message);
    detail::throw_error(CompileError(message));
  }
}

void print_warning(const std::string& warning) {
  if (warning.starts_with("performance note")) return;
  std::fprintf(stderr, "Warning: %s\n", warning.c_str());
}

bool print_warnings_by_default() {
  set_warning_handler(print_warning);
  return true;
}

namespace {

std::atomic<CompileTimeErrorReporter*> reporter = nullptr;

void report_error(const Error& error) {
  if (CompileTimeErrorReporter* to = reporter.load()) to->error(error.what());
}
void report_warning(const std::string& warning) {
  if (CompileTimeErrorReporter* to = reporter.load()) to->warning(warning.c_str());
}

}  // namespace

void set_custom_compile_time_error_reporter(CompileTimeErrorReporter* to) {
  reporter = to;
  detail::observe_errors(to ? report_error : nullptr);
  set_warning_handler(to ? report_warning : print_warning);
}

}  // namespace retrograde::porting
