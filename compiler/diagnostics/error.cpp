// error.cpp -- renders the four parts of a message, and throws.
#include "diagnostics/error.h"

#include <atomic>
#include <cctype>

namespace retrograde {

namespace {

void append_sentence(std::string& out, std::string sentence) {
  sentence.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence.front())));
  out += ' ';
  out += sentence;
  if (out.back() != '.' && out.back() != '!' && out.back() != '?') out += '.';
}

std::string with_place(const std::string& what, const std::source_location& where) {
  if (where.line() == 0) return what;
  std::string_view file = where.file_name();
  file.remove_prefix(file.find_last_of('/') + 1);
  return text(what, " [", file, ":", where.line(), "]");
}

std::string internal_text(const std::string& what, const std::string& pass,
                          const std::string& ir_before) {
  std::string out = "internal error";
  if (!pass.empty()) out += " in pass " + quoted(pass);
  out += ": " + what + "\nThis is a bug in Retrograde, not in your program.";
  if (!ir_before.empty()) {
    out += " To reproduce, run this pass alone on the program below.\n" + ir_before;
  }
  return out;
}

}  // namespace

std::string Message::render() const {
  std::string out = "cannot " + asked;
  if (!rule.empty()) out += ": " + rule;
  if (!evidence.empty()) out += "; " + evidence;
  if (out.back() != '.') out += '.';
  if (!instead.empty()) append_sentence(out, instead);
  return out;
}

Error::Error(Message message)
    : std::runtime_error(message.render()),
      message_(std::make_shared<const Message>(std::move(message))) {}

Error::Error(const std::string& text)
    : std::runtime_error(text),
      message_(std::make_shared<const Message>(Message{text, {}, {}, {}})) {}

RuntimeError::RuntimeError(Message message, int code)
    : UserError(std::move(message)), code_(code) {}

RuntimeError::RuntimeError(const std::string& text, int code) : UserError(text), code_(code) {}

InternalError::InternalError(const std::string& what) : InternalError(what, {}, {}) {}

InternalError::InternalError(const std::string& what, const std::string& pass,
                             const std::string& ir_before)
    : Error(internal_text(what, pass, ir_before)),
      details_(std::make_shared<const Details>(Details{pass, ir_before})) {}

namespace {
std::atomic<detail::ErrorObserver> error_observer = nullptr;

template <typename E>
[[noreturn]] void tell_and_throw(const E& error) {
  if (const detail::ErrorObserver tell = error_observer.load()) tell(error);
  throw error;
}
}  // namespace

detail::ErrorObserver detail::observe_errors(ErrorObserver observer) {
  return error_observer.exchange(observer);
}

void detail::throw_error(const CompileError& error) { tell_and_throw(error); }

void user_error(std::string asked, std::string rule, std::string evidence, std::string instead) {
  tell_and_throw(CompileError(
      Message{std::move(asked), std::move(rule), std::move(evidence), std::move(instead)}));
}

void call_error(std::string asked, std::string rule, std::string evidence, std::string instead,
                int code) {
  throw RuntimeError(
      Message{std::move(asked), std::move(rule), std::move(evidence), std::move(instead)}, code);
}

void unsupported(std::string asked, std::string rule, std::string evidence, std::string instead) {
  tell_and_throw(Unsupported(
      Message{std::move(asked), std::move(rule), std::move(evidence), std::move(instead)}));
}

void internal_error(const std::string& what, std::source_location where) {
  throw InternalError(with_place(what, where));
}

std::string quoted(std::string_view name) {
  std::string out = "\"";
  out += name;
  out += '"';
  return out;
}

namespace detail {

void assertion_failed(const char* condition, const std::string& what, std::source_location where) {
  std::string out = *condition ? text("expected ", condition) : std::string();
  if (!what.empty()) out += out.empty() ? what : ": " + what;
  throw InternalError(with_place(out, where));
}

}  // namespace detail

}  // namespace retrograde
