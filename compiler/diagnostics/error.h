// error.h -- the exceptions that the library throws, and the four parts of every message.
//
//   UserError      the program, the schedule or the arguments are illegal
//     CompileError   found while a pipeline is defined, scheduled or compiled
//     RuntimeError   found while a compiled pipeline is called
//   Unsupported    legal, but a known gap of this compiler
//   InternalError  a bug of the compiler: carries the pass and the program before it
//
// A message tells what was attempted (user names in quotes), which rule that breaks, the concrete
// evidence (bounds, loops, types), and what to write instead:
//
//   cannot vectorize "blur_x" over "r": iterations of a vectorized loop must be independent; its
//   update definition reads "blur_x"(r - 1). Vectorize "x" instead.
//
// Headers state the requirements of a function in the words of these messages. Each rule after
// "Requires:" throws CompileError when it is broken, or the kind of error in parentheses behind it.
// tools/api_table compares headers with messages, and docs/api.md names the test of each rule.
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

// The four parts of a message. `asked` continues "cannot ..."; `rule` and `evidence` are clauses;
// `instead` is a sentence. Only `asked` and `rule` are mandatory.
struct Message {
  std::string asked;
  std::string rule;
  std::string evidence;
  std::string instead;

  // "cannot <asked>: <rule>; <evidence>. <Instead>."
  std::string render() const;
};

// The base class: catch it to catch every error that the library reports.
class Error : public std::runtime_error {
 public:
  explicit Error(Message message);
  explicit Error(const std::string& text);

  // The four parts. An error made from plain text has all of it in `asked`.
  const Message& message() const noexcept { return *message_; }

 private:
  std::shared_ptr<const Message> message_;  // shared: copying an exception must not throw
};

class UserError : public Error {
 public:
  using Error::Error;
};

class CompileError : public UserError {
 public:
  using UserError::UserError;
};

class RuntimeError : public UserError {
 public:
  // `code` is the return value of the generated code or the runtime; 0 when the check preceded the
  // call.
  explicit RuntimeError(Message message, int code = 0);
  explicit RuntimeError(const std::string& text, int code = 0);

  int code() const noexcept { return code_; }

 private:
  int code_;
};

class Unsupported : public Error {
 public:
  using Error::Error;
};

class InternalError : public Error {
 public:
  explicit InternalError(const std::string& what);

  // The contents of a bug report. `ir_before` is the input of the pass as IR text.
  InternalError(const std::string& what, const std::string& pass, const std::string& ir_before);

  const std::string& pass() const noexcept { return details_->pass; }
  const std::string& ir_before() const noexcept { return details_->ir_before; }

 private:
  struct Details {
    std::string pass;
    std::string ir_before;
  };
  std::shared_ptr<const Details> details_;
};

namespace detail {
// Sets a function that observes every CompileError and Unsupported before the functions below throw
// it; null: none. It may be called on any thread. Returns the previous observer.
using ErrorObserver = void (*)(const Error& error);
ErrorObserver observe_errors(ErrorObserver observer);
// Throws the error after calling the observer.
[[noreturn]] void throw_error(const CompileError& error);
}  // namespace detail

// Throws CompileError: an illegal definition, schedule or compilation.
[[noreturn]] void user_error(std::string asked, std::string rule, std::string evidence = {},
                             std::string instead = {});

// Throws RuntimeError: illegal arguments of a call.
[[noreturn]] void call_error(std::string asked, std::string rule, std::string evidence = {},
                             std::string instead = {}, int code = 0);

// Throws Unsupported: legal, but not implemented.
[[noreturn]] void unsupported(std::string asked, std::string rule, std::string evidence = {},
                              std::string instead = {});

// Throws InternalError with the location of the call.
[[noreturn]] void internal_error(const std::string& what,
                                 std::source_location where = std::source_location::current());

// A user's name in quotes, as all messages show names: blur_x => "blur_x".
std::string quoted(std::string_view name);

// Concatenates streamable values: text("extent ", 3, " of ", quoted("x")).
template <typename... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream out;
  ((out << parts), ...);
  return std::move(out).str();
}
// "a, b, c": the results of `text_of` for each element.
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

// Checks an invariant of the compiler in every build. The parts after the condition explain the
// failure and are formatted only when it fails.
template <typename... Parts>
void internal_assert(bool condition, const Parts&... parts) {
  if (!condition) [[unlikely]] {
    detail::assertion_failed("", text(parts...), {});
  }
}

}  // namespace retrograde

// internal_assert with the condition's text and location: RETROGRADE_ASSERT(extent > 0, "extent is
// ", extent).
#define RETROGRADE_ASSERT(condition, ...)                                                 \
  do {                                                                                    \
    if (!(condition)) [[unlikely]] {                                                      \
      ::retrograde::detail::assertion_failed(#condition, ::retrograde::text(__VA_ARGS__), \
                                             std::source_location::current());            \
    }                                                                                     \
  } while (false)
