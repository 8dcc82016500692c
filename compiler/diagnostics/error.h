// error.h -- the exceptions of the library, and the four parts of their messages.
//
//   UserError      the program, the schedule or the arguments are illegal
//     CompileError   found while a pipeline is defined, scheduled or compiled
//     RuntimeError   found while a compiled pipeline is called
//   Unsupported    legal, but a known gap of this compiler
//   InternalError  a bug of the compiler: carries the pass and the program before it
//
// A message states the request (user names in quotes), the rule that it breaks, the concrete evidence (bounds, loops,
// types), and what to write instead:
//
//   cannot vectorize "blur_x" over "r": iterations of a vectorized loop must be independent; its
//   update definition reads "blur_x"(r - 1). Vectorize "x" instead.
//
// Headers state the requirements of a function in the words of these messages: rules follow "Requires:". Breaking one
// throws CompileError, or the kind in parentheses after the rule. tools/api_table compares headers and messages, and
// names the test of each rule in docs/api.md.
#pragma once

#include <functional>
#include <memory>
#include <source_location>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace retrograde {

// The four parts of a message. `asked` continues "cannot ..."; `rule` and `evidence` are clauses; `instead`
// is a sentence. `evidence` and `instead` may be empty.
struct Message {
  std::string asked;     // the request, continuing "cannot ..."
  std::string rule;      // the rule that it breaks
  std::string evidence;  // bounds, loops or types that show it
  std::string instead;   // advice: what to write instead

  // "cannot <asked>: <rule>; <evidence>. <Instead>."
  std::string render() const;
};

// Base of all exceptions of the library.
class Error : public std::runtime_error {
 public:
  explicit Error(Message message);  // an error with all parts
  explicit Error(const std::string& text);

  // The parts of the message. An error that was constructed from text has all of it in `asked`.
  const Message& message() const noexcept { return *message_; }

 private:
  std::shared_ptr<const Message> message_;  // shared: copying an exception must not throw
};

// The program, the schedule or the arguments are illegal.
class UserError : public Error {
 public:
  using Error::Error;  // constructed from a Message or a text
};

// A UserError that is found while a pipeline is defined, scheduled or compiled.
class CompileError : public UserError {
 public:
  using UserError::UserError;  // constructed from a Message or a text
};

// A UserError that is found while a compiled pipeline is called.
class RuntimeError : public UserError {
 public:
  // `code` is the result of the generated code or the runtime, or 0 if a check failed before the call.
  explicit RuntimeError(Message message, int code = 0);
  explicit RuntimeError(const std::string& text, int code = 0);

  int code() const noexcept { return code_; }  // error code of the call, or 0

 private:
  int code_;
};

// The program is legal, but this compiler does not support it yet.
class Unsupported : public Error {
 public:
  using Error::Error;  // constructed from a Message or a text
};

// A bug in the compiler.
class InternalError : public Error {
 public:
  // A bug outside of the passes.
  explicit InternalError(const std::string& what);

  // A bug in a pass; `ir_before` is the program before the pass, as IR text, for a bug report.
  InternalError(const std::string& what, const std::string& pass, const std::string& ir_before);

  // Name of the pass, or empty.
  const std::string& pass() const noexcept { return details_->pass; }
  // The program before the pass, or empty.
  const std::string& ir_before() const noexcept { return details_->ir_before; }

 private:
  struct Details {
    std::string pass;
    std::string ir_before;
  };
  std::shared_ptr<const Details> details_;
};

namespace detail {
// Receives every CompileError and Unsupported of the functions below before it is thrown, on any thread.
using ErrorObserver = void (*)(const Error& error);
// Sets the observer, null for none, and returns the previous one.
ErrorObserver observe_errors(ErrorObserver observer);
// Notifies the observer and throws.
[[noreturn]] void throw_error(const CompileError& error);
}  // namespace detail

// Throws CompileError: the definition, schedule or compilation is illegal.
[[noreturn]] void user_error(std::string asked, std::string rule, std::string evidence = {},
                             std::string instead = {});

// Throws RuntimeError: the arguments of a call do not fit.
[[noreturn]] void call_error(std::string asked, std::string rule, std::string evidence = {},
                             std::string instead = {}, int code = 0);

// Throws Unsupported: legal, but not implemented.
[[noreturn]] void unsupported(std::string asked, std::string rule, std::string evidence = {},
                              std::string instead = {});

// Throws InternalError with the place of the call.
[[noreturn]] void internal_error(const std::string& what,
                                 std::source_location where = std::source_location::current());

// A name in quotes, as all messages show names: blur_x => "blur_x".
std::string quoted(std::string_view name);

// Concatenates streamable values: text("extent ", 3, " of ", quoted("x")).
template <typename... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream out;
  ((out << parts), ...);
  return std::move(out).str();
}
// The elements as text, separated by commas: "a, b, c".
template <class List, class TextOf = std::identity>
requires requires(const List& list, const TextOf& text_of) { text_of(*list.begin()); }
std::string listed(const List& list, const TextOf& text_of = {}) {
  std::string out;
  for (const auto& one : list) out += (out.empty() ? "" : ", ") + text_of(one);
  return out;
}

namespace detail {
[[noreturn]] void assertion_failed(const char* condition, const std::string& what,
                                   std::source_location where);
}  // namespace detail

// Checks an invariant of the compiler in every build. The parts after the condition explain the failure and
// are formatted only then.
template <typename... Parts>
void internal_assert(bool condition, const Parts&... parts) {
  if (!condition) [[unlikely]] {
    detail::assertion_failed("", text(parts...), {});
  }
}

}  // namespace retrograde

// internal_assert with the text and place of the condition: RETROGRADE_ASSERT(extent > 0, "extent is ", extent).
#define RETROGRADE_ASSERT(condition, ...)                                                 \
  do {                                                                                    \
    if (!(condition)) [[unlikely]] {                                                      \
      ::retrograde::detail::assertion_failed(#condition, ::retrograde::text(__VA_ARGS__), \
                                             std::source_location::current());            \
    }                                                                                     \
  } while (false)
