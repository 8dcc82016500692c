#include "outcome.h"

#include <cstring>

#include "testing/check_program.h"

namespace device_check {

using namespace retrograde;

namespace {

// Replaces every NaN by the same one, because the bits of a NaN are unspecified.
template <typename T, int exponent_bits, int mantissa_bits>
void make_one_nan(std::string& bytes) {
  constexpr T mantissa = (T{1} << mantissa_bits) - 1, exponent = ((T{1} << exponent_bits) - 1)
                                                                 << mantissa_bits;
  for (size_t at = 0; at + sizeof(T) <= bytes.size(); at += sizeof(T)) {
    T value;
    std::memcpy(&value, &bytes[at], sizeof value);
    if ((value & exponent) != exponent || (value & mantissa) == 0) continue;
    value = exponent | (T{1} << (mantissa_bits - 1));
    std::memcpy(&bytes[at], &value, sizeof value);
  }
}

}  // namespace

std::string bytes_of(Buffer<>& buffer) {
  if (buffer.device_dirty()) buffer.copy_to_host();
  std::string bytes(reinterpret_cast<const char*>(buffer.data()), buffer.size_in_bytes());
  const Type type = buffer.type();
  if (type == Float(64)) make_one_nan<uint64_t, 11, 52>(bytes);
  if (type == Float(32)) make_one_nan<uint32_t, 8, 23>(bytes);
  if (type == Float(16)) make_one_nan<uint16_t, 5, 10>(bytes);
  if (type == BFloat(16)) make_one_nan<uint16_t, 8, 7>(bytes);
  return bytes;
}

Record recorded(const std::string& name, const std::function<std::string()>& compute) {
  Record record;
  record.name = name;
  try {
    record.bytes = compute();
  } catch (const RuntimeError& error) {
    // A program's memory may only be known when it runs.
    record.state = fuzz::lacks_memory(error) ? Record::State::Refused : Record::State::Failed;
    record.bytes = error.what();
  } catch (const UserError& error) {
    record.state = Record::State::Refused;
    record.bytes = error.what();
  } catch (const Unsupported& error) {
    record.state = Record::State::Refused;
    record.bytes = error.what();
  } catch (const std::exception& error) {
    record.state = Record::State::Failed;
    record.bytes = error.what();
  }
  return record;
}

}  // namespace device_check
