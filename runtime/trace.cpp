// Events of traced pipelines. They go to the context's handler or, as text, to the print handler. If HL_TRACE_FILE is
// set in the environment, they go to that file as packets.
#include "trace.h"

#include <HalideRuntime.h>
#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <new>
#include <string>
#include <vector>

#include "report.h"
#include "write_all.h"

namespace retrograde::runtime {
namespace {

std::atomic<int32_t> next_id{1};
constexpr int no_file = -2;

// ---- text ----

const char* const event_names[] = {
    "Load",    "Store",       "Begin realization", "End realization", "Produce", "End produce",
    "Consume", "End consume", "Begin pipeline",    "End pipeline",    "Tag"};

template <typename T, typename... Format>
void append(std::string& text, T value, Format... format) {
  char digits[400];
  const auto end = std::to_chars(digits, digits + sizeof digits, value, format...);
  text.append(digits, end.ptr);
}

template <typename T>
T element(const void* values, int lane) {
  T value;
  std::memcpy(&value, static_cast<const char*>(values) + sizeof(T) * static_cast<size_t>(lane),
              sizeof(T));
  return value;
}

float half_to_float(uint16_t bits) {
  const int exponent = bits >> 10 & 31, mantissa = bits & 1023;
  const float sign = bits >> 15 ? -1.f : 1.f;
  if (exponent == 31) return mantissa ? __builtin_nanf("") : sign * __builtin_inff();
  if (exponent == 0) return sign * static_cast<float>(mantissa) * 0x1p-24f;
  return sign * __builtin_ldexpf(static_cast<float>(mantissa | 1024), exponent - 25);
}

float bfloat_to_float(uint16_t bits) {
  const uint32_t wide = uint32_t{bits} << 16;
  float value;
  std::memcpy(&value, &wide, sizeof value);
  return value;
}

void append_integer(std::string& text, halide_type_t type, const void* values, int lane) {
  const bool is_signed = type.code == halide_type_int;
  switch (type.bytes()) {
    case 1:
      return is_signed ? append(text, int{element<int8_t>(values, lane)})
                       : append(text, int{element<uint8_t>(values, lane)});
    case 2:
      return is_signed ? append(text, int{element<int16_t>(values, lane)})
                       : append(text, int{element<uint16_t>(values, lane)});
    case 4:
      return is_signed ? append(text, element<int32_t>(values, lane))
                       : append(text, element<uint32_t>(values, lane));
    default:
      return is_signed ? append(text, element<int64_t>(values, lane))
                       : append(text, element<uint64_t>(values, lane));
  }
}

void append_value(std::string& text, halide_type_t type, const void* values, int lane) {
  constexpr int digits = 6;
  if (type.code == halide_type_handle) {
    text += "0x";
    append(text, element<uint64_t>(values, lane), 16);
  } else if (type.code == halide_type_bfloat) {
    append(text, bfloat_to_float(element<uint16_t>(values, lane)), std::chars_format::fixed,
           digits);
  } else if (type.code != halide_type_float) {
    append_integer(text, type, values, lane);
  } else if (type.bits == 16) {
    append(text, half_to_float(element<uint16_t>(values, lane)), std::chars_format::fixed, digits);
  } else if (type.bits == 32) {
    append(text, element<float>(values, lane), std::chars_format::fixed, digits);
  } else {
    append(text, element<double>(values, lane), std::chars_format::scientific, digits);
  }
}

// "<a, b>" for vectors, "a" for one.
template <typename Append>
void append_lanes(std::string& text, int lanes, const Append& append_lane) {
  if (lanes > 1) text += '<';
  for (int lane = 0; lane < lanes; lane++) {
    if (lane > 0) text += ", ";
    append_lane(lane);
  }
  if (lanes > 1) text += '>';
}

bool is_access(const halide_trace_event_t& e) {
  return e.event == halide_trace_load || e.event == halide_trace_store;
}

std::string text_of(const halide_trace_event_t& e) {
  const int lanes = is_access(e) && e.type.lanes > 1 ? e.type.lanes : 1;
  std::string text = event_names[e.event];
  text += ' ';
  text += e.func;
  text += '.';
  append(text, e.value_index);
  text += '(';
  for (int i = 0; i < e.dimensions / lanes; i++) {
    if (i > 0) text += ", ";
    append_lanes(text, lanes, [&](int lane) { append(text, e.coordinates[i * lanes + lane]); });
  }
  text += ')';
  if (is_access(e)) {
    text += " = ";
    append_lanes(text, lanes, [&](int lane) { append_value(text, e.type, e.value, lane); });
  }
  if (e.trace_tag) {
    text += " tag = \"";
    text += e.trace_tag;
    text += '"';
  }
  return text + "\n";
}

// ---- packets ----

std::vector<char> packet_of(const halide_trace_event_t& e, int32_t id) {
  const size_t value_bytes =
      e.value ? static_cast<size_t>(e.type.lanes) * static_cast<size_t>(e.type.bytes()) : 0;
  const size_t coordinate_bytes = sizeof(int32_t) * static_cast<size_t>(e.dimensions);
  const char* tag = e.trace_tag ? e.trace_tag : "";
  const size_t func_bytes = std::strlen(e.func) + 1, tag_bytes = std::strlen(tag) + 1;
  const size_t used =
      sizeof(halide_trace_packet_t) + coordinate_bytes + value_bytes + func_bytes + tag_bytes;
  std::vector<char> packet((used + 3) / 4 * 4);
  halide_trace_packet_t header = {};
  header.size = static_cast<uint32_t>(packet.size());
  header.id = id;
  header.type = e.value ? e.type : halide_type_t(halide_type_int, 0, 0);
  header.event = e.event;
  header.parent_id = e.parent_id;
  header.value_index = e.value_index;
  header.dimensions = e.dimensions;
  char* to = packet.data();
  const auto put = [&](const void* from, size_t bytes) {
    if (bytes > 0) std::memcpy(to, from, bytes);
    to += bytes;
  };
  put(&header, sizeof header);
  put(e.coordinates, coordinate_bytes);
  put(e.value, value_bytes);
  put(e.func, func_bytes);
  put(tag, tag_bytes);
  return packet;
}

// Writes packets completely, one after another, also from different threads.
bool write_packet(int file, const std::vector<char>& packet) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  return write_all(file, packet.data(), packet.size());
}

std::atomic<bool> has_complained{false};

void print(retrograde_context* context, const char* text) {
  if (context && context->print_handler) context->print_handler(context, text);
}

// The file to write to; -1 until HL_TRACE_FILE has been read. Protected by `file_mutex`.
int chosen_file = -1;
bool is_own_file = false;
std::mutex file_mutex;

// If the file cannot be opened, the first event reports that it cannot be written.
int open_from_environment() {
  const char* path = std::getenv("HL_TRACE_FILE");
  if (!path || !*path) return 0;
  is_own_file = true;
  const int file = open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  return file < 0 ? no_file : file;
}

}  // namespace

int trace_file() {
  const std::lock_guard lock(file_mutex);
  if (chosen_file == -1) chosen_file = open_from_environment();
  return chosen_file;
}

bool set_trace_file(int file) {
  const std::lock_guard lock(file_mutex);
  const bool closes = is_own_file && chosen_file > 0;
  const bool closed = !closes || close(chosen_file) == 0;
  chosen_file = file;
  is_own_file = false;
  has_complained = false;
  return closed;
}

}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

int32_t retrograde_default_trace(retrograde_context* context, const halide_trace_event_t* event) {
  return rt::trace_to(rt::trace_file(), context, event);
}

int32_t rt::trace_to(int file, retrograde_context* context, const halide_trace_event_t* event) {
  const int32_t id = rt::next_id.fetch_add(1, std::memory_order_relaxed);
  try {
    if (file == 0) {
      rt::print(context, rt::text_of(*event).c_str());
    } else if (!rt::write_packet(file, rt::packet_of(*event, id)) &&
               !rt::has_complained.exchange(true)) {
      rt::print(context, "cannot write the trace: its file cannot be written\n");
    }
  } catch (const std::bad_alloc&) {  // the event is lost
  }
  return id;
}

int32_t retrograde_trace(retrograde_context* context, const halide_trace_event_t* event) {
  return context && context->trace_handler ? context->trace_handler(context, event)
                                           : retrograde_default_trace(context, event);
}

int32_t retrograde_trace_region(retrograde_context* context, const char* func, int32_t event,
                                int32_t parent, int32_t* coordinates, int32_t count,
                                const char* tag) {
  halide_trace_event_t e = {};
  e.func = func;
  e.coordinates = coordinates;
  e.trace_tag = tag;
  e.event = static_cast<halide_trace_event_code_t>(event);
  e.type = halide_type_t(halide_type_handle, 0, 0);  // there is no value
  e.parent_id = parent;
  e.dimensions = count;
  return retrograde_trace(context, &e);
}

int32_t retrograde_trace_type(retrograde_context* context, const char* func, int32_t parent,
                              const char* type, const int32_t* region, int32_t count) {
  try {
    std::string text = type;
    for (int32_t i = 0; i < count; i++) {
      text += ' ';
      rt::append(text, region[i]);
    }
    return retrograde_trace_region(context, func, halide_trace_tag, parent, nullptr, 0,
                                   text.c_str());
  } catch (const std::bad_alloc&) {
    return retrograde_trace_region(context, func, halide_trace_tag, parent, nullptr, 0, type);
  }
}
