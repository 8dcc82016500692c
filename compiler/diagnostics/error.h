// error.h -- the exceptions that the library throws, and the four parts that every message has.
//
//   UserError      the program, the schedule or the arguments are illegal
//     CompileError   found while a pipeline is defined, scheduled or compiled
//     RuntimeError   found while a compiled pipeline is called
//   Unsupported    legal, but a known gap of this compiler
//   InternalError  our own bug: carries the pass and the program before it
//
// A message says what was asked (user names in quotes), which rule that breaks, the concrete
// evidence (bounds, loops, types), and what to write instead:
//
//   cannot vectorize "blur_x" over "r": iterations of a vectorized loop must be independent; its
//   update definition reads "blur_x"(r - 1). Vectorize "x" instead.
//
// Headers say what a function asks of its callers in the words of these messages: after "Requires:"
// stand rules, which throw CompileError where they are broken, or the kind in parentheses behind.
// tools/api_table holds them against each other, and names the test of each in docs/api.md.
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
// `instead` is a sentence. Only `asked` and `rule` must be given.
struct Message {
  std::string asked;
  std::string rule;
  std::string evidence;
  std::string instead;

  // "cannot <asked>: <rule>; <evidence>. <Instead>."
  std::string render() const;
};

// Base of all: catch this to catch everything the library reports.
class Error : public std::runtime_error {
 public:
  explicit Error(Message message);
  explicit Error(const std::string& text);

  // The parts. For an error made from plain text everything stands in `asked`.
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
  // `code` is what the generated code or the runtime returned, 0 when the check came before the
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

  // What a bug report needs. `ir_before` is the program that the pass was given, as IR text.
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
// Told of every CompileError and Unsupported before it is thrown by the functions below; null: nobody.
// By any thread. The one before comes back.
using ErrorObserver = void (*)(const Error& error);
ErrorObserver observe_errors(ErrorObserver observer);
// Throws it, after the observer was told.
[[noreturn]] void throw_error(const CompileError& error);
}  // namespace detail

// Throws CompileError: a definition, schedule or compilation that cannot be.
[[noreturn]] void user_error(std::string asked, std::string rule, std::string evidence = {},
                             std::string instead = {});

// Throws RuntimeError: arguments of a call that do not fit.
[[noreturn]] void call_error(std::string asked, std::string rule, std::string evidence = {},
                             std::string instead = {}, int code = 0);

// Throws Unsupported: legal, but not built yet.
[[noreturn]] void unsupported(std::string asked, std::string rule, std::string evidence = {},
                              std::string instead = {});

// Throws InternalError with the place where it was called.
[[noreturn]] void internal_error(const std::string& what,
                                 std::source_location where = std::source_location::current());

// A user's name in quotes, the way all messages show names: blur_x => "blur_x".
std::string quoted(std::string_view name);

// Everything streamable, put together: text("extent ", 3, " of ", quoted("x")).
template <typename... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream out;
  ((out << parts), ...);
  return std::move(out).str();
}
// "a, b, c": what `text_of` makes of each.
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

// An invariant of ours, checked in every build. The parts after the condition explain the failure
// and are put together only when it fails.
template <typename... Parts>
void internal_assert(bool condition, const Parts&... parts) {
  if (!condition) [[unlikely]] {
    detail::assertion_failed("", text(parts...), {});
  }
}

}  // namespace retrograde

// The same with the condition's text and place: RETROGRADE_ASSERT(extent > 0, "extent is ",
// extent).
#define RETROGRADE_ASSERT(condition, ...)                                                 \
  do {                                                                                    \
    if (!(condition)) [[unlikely]] {                                                      \
      ::retrograde::detail::assertion_failed(#condition, ::retrograde::text(__VA_ARGS__), \
                                             std::source_location::current());            \
    }                                                                                     \
  } while (false)
