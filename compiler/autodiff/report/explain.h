// What differentiation did and did not do, for people: Derivative::explain().
#pragma once

#include <string>
#include <vector>

namespace retrograde {

// One fact. `subject` is the user's name of the Func, image or parameter that it is about.
struct Explanation {
  enum class Kind {
    Built,         // an adjoint was built; detail says how it accumulates
    Scattered,     // an index depends on data
    Privatised,    // accumulated in parts, then summed in order
    Zero,          // the gradient is identically zero, and why
    NotRequested,  // left out: nothing that was asked for needs it
    Version,       // an update needed the adjoint or the value of an earlier version
    Performance,   // legal, but slow
    Stored,        // values that are computed once and kept: bytes and operations
    Recomputed,    // values that are computed again at each read: reads and operations
    LeftOut,       // values of the output's pipeline that the gradient needs nothing of
    Cost,          // operations and bytes of the output and of its gradient
    Custom,        // a rule that the user wrote stands for the definitions
  };
  Kind kind;
  std::string subject;
  std::string detail;
  double bytes = 0;  // of what is stored, where that is known
};

// How much explain() tells.
enum class Detail {
  Summary,  // a line for the cost and one for each kind of fact, with the names that it is about
  All,      // a line for each fact, with its reason
};

const char* to_string(Explanation::Kind kind);
// Names are shown without their numbers (`f`, not `f$3`) where only one of that name is told of.
std::string to_string(const std::vector<Explanation>& explanations, Detail detail = Detail::All);

}  // namespace retrograde
