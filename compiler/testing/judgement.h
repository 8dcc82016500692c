// judgement.h -- the verdict of a check on one random program.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace retrograde::fuzz {

enum class Judgement : uint8_t {
  Right,
  Kink,  // gradients only: at a kink or jump, where differences do not apply; forward agrees with reverse
  Refused,  // UserError or Unsupported
  Illegal,  // the program itself is refused, or its value is not finite
  Wrong,
  Broken,  // InternalError or another exception
};

struct Judged {
  Judgement judgement = Judgement::Right;
  std::string detail = {};
  std::map<std::string, uint64_t> counts = {};  // statistics, by name
};

inline const char* name_of(Judgement judgement) {
  static const char* const names[] = {"right",   "at a kink", "refused",
                                      "illegal", "wrong",     "breaking the compiler"};
  return names[static_cast<int>(judgement)];
}

}  // namespace retrograde::fuzz
