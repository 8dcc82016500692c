// Error and print messages: a small formatter, and their path from generated code to the handlers.
#include <algorithm>
#include <charconv>
#include <cstdarg>
#include <cstring>

#include "inquiries.h"
#include "report.h"

namespace retrograde::runtime {
namespace {

// Appends to a fixed-size array and drops text that does not fit.
class Text {
 public:
  Text(char* text, size_t size) : begin_(text), next_(text), last_(text + size - 1) {}
  void append(const char* from, size_t length) {
    length = std::min(length, static_cast<size_t>(last_ - next_));
    std::memcpy(next_, from, length);
    next_ += length;
  }
  void append(const char* from) { append(from, std::strlen(from)); }
  template <typename T, typename... Format>
  void append_number(T value, Format... format) {
    char digits[64];
    const auto end = std::to_chars(digits, digits + sizeof digits, value, format...);
    append(digits, static_cast<size_t>(end.ptr - digits));
  }
  size_t finish() {
    *next_ = 0;
    return static_cast<size_t>(next_ - begin_);
  }

 private:
  char *begin_, *next_, *last_;
};

// Formats one field; false if the letter is unknown.
bool append_field(Text& text, char field, va_list& args) {
  switch (field) {
    case 'i':
      text.append_number(va_arg(args, int64_t));
      return true;
    case 'u':
      text.append_number(va_arg(args, uint64_t));
      return true;
    case 'f':
      text.append_number(va_arg(args, double));
      return true;
    case 'g':
      text.append_number(static_cast<float>(va_arg(args, double)));
      return true;
    case 'F':
      text.append_number(static_cast<float>(va_arg(args, double)), std::chars_format::fixed, 6);
      return true;
    case 'E':
      text.append_number(va_arg(args, double), std::chars_format::scientific, 6);
      return true;
    case '%':
      text.append("%");
      return true;
    case 's': {
      const char* value = va_arg(args, const char*);
      text.append(value ? value : "(null)");
      return true;
    }
    case 'p':
      text.append("0x");
      text.append_number(reinterpret_cast<uintptr_t>(va_arg(args, const void*)), 16);
      return true;
    default:
      return false;
  }
}

size_t format_message(char* out, size_t size, const char* format, va_list& args) {
  if (size == 0) return 0;
  Text text(out, size);
  while (const char* percent = std::strchr(format, '%')) {
    text.append(format, static_cast<size_t>(percent - format));
    if (!append_field(text, percent[1], args)) break;
    format = percent + 2;
  }
  text.append(format);
  return text.finish();
}

thread_local Failure* current_failure = nullptr;

}  // namespace

FailureScope::FailureScope(Failure* failure) : outer_(current_failure) {
  current_failure = failure;
}
FailureScope::~FailureScope() { current_failure = outer_; }

bool keep_for_loop(const char* message) {
  if (current_failure) current_failure->set(message);
  return current_failure != nullptr;
}

void report(retrograde_context* context, int32_t code, const char* message) {
  if (keep_for_loop(message)) return;
  if (context && context->error_handler) context->error_handler(context, code, message);
}

void Failure::set(const char* text) {
  const size_t length = std::min(std::strlen(text), sizeof message - 1);
  std::memcpy(message, text, length);
  message[length] = 0;
}

}  // namespace retrograde::runtime

using retrograde::runtime::format_message;
using retrograde::runtime::max_message_bytes;

size_t retrograde_format_message(char* text, size_t size, const char* format, ...) {
  va_list args;
  va_start(args, format);
  const size_t length = format_message(text, size, format, args);
  va_end(args);
  return length;
}

int32_t retrograde_report_error(retrograde_context* context, int32_t code, const char* format,
                                ...) {
  char message[max_message_bytes];
  va_list args;
  va_start(args, format);
  format_message(message, sizeof message, format, args);
  va_end(args);
  retrograde::runtime::report(context, code, message);
  return code;
}

void retrograde_print(retrograde_context* context, const char* format, ...) {
  if (!context || !context->print_handler) return;
  char message[max_message_bytes];
  va_list args;
  va_start(args, format);
  format_message(message, sizeof message, format, args);
  va_end(args);
  context->print_handler(context, message);
}

void* retrograde_user_context(retrograde_context* context) {
  return context ? context->user_data : nullptr;
}

const char* retrograde_error_name(int32_t code) {
  switch (code) {
    case retrograde_error_success:
      return "success";
    case retrograde_error_generic:
      return "generic error";
    case retrograde_error_explicit_bounds_too_small:
      return "explicit bounds too small";
    case retrograde_error_bad_type:
      return "bad element type";
    case retrograde_error_access_out_of_bounds:
      return "access out of bounds";
    case retrograde_error_allocation_too_large:
      return "allocation too large";
    case retrograde_error_extents_too_large:
      return "extents too large";
    case retrograde_error_constraints_make_required_region_smaller:
      return "constraints make the required region smaller";
    case retrograde_error_constraint_violated:
      return "constraint violated";
    case retrograde_error_param_too_small:
      return "parameter too small";
    case retrograde_error_param_too_large:
      return "parameter too large";
    case retrograde_error_out_of_memory:
      return "out of memory";
    case retrograde_error_buffer_argument_is_null:
      return "buffer argument is null";
    case retrograde_error_debug_to_file_failed:
      return "a file cannot be written";
    case retrograde_error_copy_to_host_failed:
      return "copy to the host failed";
    case retrograde_error_copy_to_device_failed:
      return "copy to the device failed";
    case retrograde_error_device_malloc_failed:
      return "no memory on the device";
    case retrograde_error_device_sync_failed:
      return "waiting for the device failed";
    case retrograde_error_device_free_failed:
      return "freeing device memory failed";
    case retrograde_error_no_device_interface:
      return "no device interface";
    case retrograde_error_device_run_failed:
      return "a kernel cannot run";
    case retrograde_error_device_wrap_native_failed:
      return "wrapping device memory failed";
    case retrograde_error_device_detach_native_failed:
      return "detaching device memory failed";
    case retrograde_error_device_interface_no_device:
      return "a device interface without device memory";
    case retrograde_error_host_and_device_dirty:
      return "newer on the host and on the device";
    case retrograde_error_buffer_is_null:
      return "buffer is null";
    case retrograde_error_device_buffer_copy_failed:
      return "copying a buffer failed";
    case retrograde_error_device_crop_failed:
      return "cropping device memory failed";
    case retrograde_error_incompatible_device_interface:
      return "another device interface";
    case retrograde_error_internal:
      return "internal error";
    case retrograde_error_unaligned_host_ptr:
      return "unaligned host pointer";
    case retrograde_error_bad_fold:
      return "bad fold";
    case retrograde_error_fold_factor_too_small:
      return "fold factor too small";
    case retrograde_error_requirement_failed:
      return "requirement failed";
    case retrograde_error_extents_negative:
      return "negative extent";
    case retrograde_error_specialize_fail:
      return "no specialization fits";
    case retrograde_error_host_is_null:
      return "host pointer is null";
    case retrograde_error_bad_dimensions:
      return "wrong number of dimensions";
    case retrograde_error_device_dirty_with_no_device_support:
      return "data on a device";
    default:
      return "unknown error";
  }
}
