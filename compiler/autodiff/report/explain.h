// explain.h -- the facts that Derivative::explain() reports about a gradient.
#pragma once

#include <string>
#include <vector>

namespace retrograde {

// One fact. `subject` is the user's name of the Func, image or parameter.
struct Explanation {
  enum class Kind {
    Built,         // an adjoint was built; detail says how it accumulates
    Scattered,     // an index is data-dependent
    Privatised,    // accumulated in privatised copies, then summed in order
    Zero,          // the gradient is identically zero, and why
    NotRequested,  // not built, because no requested gradient needs it
    Version,       // an update needed the adjoint or the value of an earlier version
    Performance,   // legal, but slow
    Stored,        // values that are computed once and kept: bytes and operations
    Recomputed,    // values that are recomputed at each read: reads and operations
    LeftOut,       // Funcs of the output's pipeline whose values the gradient does not need
    Cost,          // operations and bytes of the output and of its gradient
    Custom,        // a user's rule replaces the definitions
  };
  Kind kind;
  std::string subject;
  std::string detail;
  double bytes = 0;  // bytes stored, if known
};

// How detailed explain() is.
enum class Detail {
  Summary,  // a line for the cost and one for each kind of fact, with its subjects
  All,      // a line for each fact, with its reason
};

const char* to_string(Explanation::Kind kind);
// Names are shown without their numbers (`f`, not `f$3`) where that is unambiguous.
std::string to_string(const std::vector<Explanation>& explanations, Detail detail = Detail::All);

}  // namespace retrograde
