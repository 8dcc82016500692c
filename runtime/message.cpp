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

struct ErrorName {
  int32_t code;
  const char* text;
};
constexpr ErrorName error_names[] = {
    {retrograde_error_success, "success"},
    {retrograde_error_generic, "generic error"},
    {retrograde_error_explicit_bounds_too_small, "explicit bounds too small"},
    {retrograde_error_bad_type, "bad element type"},
    {retrograde_error_access_out_of_bounds, "access out of bounds"},
    {retrograde_error_allocation_too_large, "allocation too large"},
    {retrograde_error_extents_too_large, "extents too large"},
    {retrograde_error_constraints_make_required_region_smaller,
     "constraints make the required region smaller"},
    {retrograde_error_constraint_violated, "constraint violated"},
    {retrograde_error_param_too_small, "parameter too small"},
    {retrograde_error_param_too_large, "parameter too large"},
    {retrograde_error_out_of_memory, "out of memory"},
    {retrograde_error_buffer_argument_is_null, "buffer argument is null"},
    {retrograde_error_debug_to_file_failed, "a file cannot be written"},
    {retrograde_error_copy_to_host_failed, "copy to the host failed"},
    {retrograde_error_copy_to_device_failed, "copy to the device failed"},
    {retrograde_error_device_malloc_failed, "no memory on the device"},
    {retrograde_error_device_sync_failed, "waiting for the device failed"},
    {retrograde_error_device_free_failed, "freeing device memory failed"},
    {retrograde_error_no_device_interface, "no device interface"},
    {retrograde_error_device_run_failed, "a kernel cannot run"},
    {retrograde_error_device_wrap_native_failed, "wrapping device memory failed"},
    {retrograde_error_device_detach_native_failed, "detaching device memory failed"},
    {retrograde_error_device_interface_no_device, "a device interface without device memory"},
    {retrograde_error_host_and_device_dirty, "newer on the host and on the device"},
    {retrograde_error_buffer_is_null, "buffer is null"},
    {retrograde_error_device_buffer_copy_failed, "copying a buffer failed"},
    {retrograde_error_device_crop_failed, "cropping device memory failed"},
    {retrograde_error_incompatible_device_interface, "another device interface"},
    {retrograde_error_internal, "internal error"},
    {retrograde_error_unaligned_host_ptr, "unaligned host pointer"},
    {retrograde_error_bad_fold, "bad fold"},
    {retrograde_error_fold_factor_too_small, "fold factor too small"},
    {retrograde_error_requirement_failed, "requirement failed"},
    {retrograde_error_extents_negative, "negative extent"},
    {retrograde_error_specialize_fail, "no specialization fits"},
    {retrograde_error_host_is_null, "host pointer is null"},
    {retrograde_error_bad_dimensions, "wrong number of dimensions"},
    {retrograde_error_device_dirty_with_no_device_support, "data on a device"},
};

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
  for (const retrograde::runtime::ErrorName& name : retrograde::runtime::error_names) {
    if (name.code == code) return name.text;
  }
  return "unknown error";
}
