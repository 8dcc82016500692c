#include "ir/phase_check.h"

#include "diagnostics/error.h"

namespace retrograde::ir {

namespace {

const char* phase_name(Phase phase) {
  static constexpr const char* names[] = {"Nests", "Loops", "FlatStorage", "Vector"};
  return names[static_cast<int>(phase)];
}

constexpr size_t shown_characters = 4000;

std::string shortened(const std::string& text) {
  return text.size() > shown_characters ? text.substr(0, shown_characters) + "\n..." : text;
}

}  // namespace

void PhaseCheck::blame(const std::string& rule, const std::string& node) const {
  throw InternalError(text("after this pass the program breaks a rule of the phase ",
                           phase_name(phase_), ": ", rule, "\n  in: ", shortened(node)),
                      pass_, before_.defined() ? print(before_) : "");
}

}  // namespace retrograde::ir
