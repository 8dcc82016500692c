// Func::debug_to_file: writes computed values to a file.
//
//   .tmp   five int32 words, the first four extents and a type code, then the elements in storage order
//   .npy   NumPy's format, version 1.0, Fortran order
#include <HalideRuntime.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <new>
#include <string>
#include <vector>

#include "report.h"

namespace retrograde::runtime {
namespace {

// The elements of a buffer without padding, dimension 0 innermost.
std::vector<char> elements_of(const halide_buffer_t& b) {
  const auto bytes = static_cast<size_t>(b.type.bytes());
  size_t count = 1;
  for (int d = 0; d < b.dimensions; d++)
    count *= static_cast<size_t>(b.dim[d].extent > 0 ? b.dim[d].extent : 0);
  std::vector<char> result(count * bytes);
  std::vector<int32_t> at(static_cast<size_t>(b.dimensions));
  for (size_t i = 0; i < count; i++) {
    int64_t offset = 0;
    for (int d = 0; d < b.dimensions; d++)
      offset += int64_t{at[static_cast<size_t>(d)]} * b.dim[d].stride;
    std::memcpy(result.data() + i * bytes, b.host + offset * static_cast<int64_t>(bytes), bytes);
    for (int d = 0; d < b.dimensions && ++at[static_cast<size_t>(d)] == b.dim[d].extent; d++)
      at[static_cast<size_t>(d)] = 0;
  }
  return result;
}

int32_t type_code(halide_type_t type) {
  if (type.code == halide_type_float) return type.bits == 64 ? 1 : 0;
  const int32_t of_8_bits = type.code == halide_type_uint ? 2 : 3;
  return type.bytes() == 1   ? of_8_bits
         : type.bytes() == 2 ? of_8_bits + 2
         : type.bytes() == 4 ? of_8_bits + 4
                             : of_8_bits + 6;
}

std::string tmp_header(const halide_buffer_t& b) {
  std::array<int32_t, 5> words = {1, 1, 1, 1, type_code(b.type)};
  for (int d = 0; d < b.dimensions && d < 4; d++) words[static_cast<size_t>(d)] = b.dim[d].extent;
  return {reinterpret_cast<const char*>(words.data()), sizeof words};
}

std::string npy_header(const halide_buffer_t& b) {
  const char kind = b.type.bits == 1                    ? 'b'
                    : b.type.code == halide_type_float  ? 'f'
                    : b.type.code == halide_type_uint   ? 'u'
                    : b.type.code == halide_type_bfloat ? 'V'
                                                        : 'i';
  std::string shape;
  for (int d = 0; d < b.dimensions; d++) shape += std::to_string(b.dim[d].extent) + ",";
  std::string dictionary = std::string("{'descr': '") + (b.type.bytes() == 1 ? '|' : '<') + kind +
                           std::to_string(b.type.bytes()) + "', 'fortran_order': True, 'shape': (" +
                           shape + "), }";
  constexpr size_t prefix = 10, alignment = 64;
  const size_t total = (prefix + dictionary.size() + 1 + alignment - 1) / alignment * alignment;
  dictionary.resize(total - prefix - 1, ' ');
  dictionary += '\n';
  const auto length = static_cast<uint16_t>(dictionary.size());
  std::string header("\x93NUMPY\x01\x00", 8);
  header += static_cast<char>(length & 255);
  header += static_cast<char>(length >> 8);
  return header + dictionary;
}

bool ends_with(const std::string& text, const char* end) {
  const size_t length = std::strlen(end);
  return text.size() >= length && text.compare(text.size() - length, length, end) == 0;
}

bool write(const std::string& path, const std::string& header, const std::vector<char>& data) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (!file) return false;
  bool good = std::fwrite(header.data(), 1, header.size(), file) == header.size();
  good = good && std::fwrite(data.data(), 1, data.size(), file) == data.size();
  return std::fclose(file) == 0 && good;
}

}  // namespace
}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

int32_t retrograde_debug_to_file(retrograde_context* context, const char* path,
                                 const halide_buffer_t* buffer) {
  try {
    const std::string header =
        rt::ends_with(path, ".npy") ? rt::npy_header(*buffer) : rt::tmp_header(*buffer);
    if (rt::write(path, header, rt::elements_of(*buffer))) return 0;
  } catch (const std::bad_alloc&) {
    return retrograde_report_error(context, retrograde_error_out_of_memory,
                                   "cannot write \"%s\": there is not enough memory", path);
  }
  return retrograde_report_error(context, retrograde_error_debug_to_file_failed,
                                 "cannot write \"%s\": debug_to_file needs a file that can be "
                                 "written. Name one in a folder that exists",
                                 path);
}
