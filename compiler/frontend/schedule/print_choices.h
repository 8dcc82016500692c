// print_choices.h -- stream output of targets, type codes, loop levels and the enumerations of directives.
#pragma once

#include <iosfwd>

#include "frontend/schedule/loop_level.h"
#include "graph/schedule.h"
#include "ir/target.h"

namespace retrograde {

// Prints enumerators by their C++ names, and a target as target(x86-64-linux-avx2), as Halide does.
std::ostream& operator<<(std::ostream& out, const Target& target);
std::ostream& operator<<(std::ostream& out, TypeCode code);  // int, uint, float, bfloat, handle
std::ostream& operator<<(std::ostream& out, DeviceAPI device);
std::ostream& operator<<(std::ostream& out, MemoryType memory);
std::ostream& operator<<(std::ostream& out, TailStrategy tail);
std::ostream& operator<<(std::ostream& out, LoopAlignStrategy align);
std::ostream& operator<<(std::ostream& out, PrefetchBoundStrategy bound);
std::ostream& operator<<(std::ostream& out, Partition partition);
std::ostream& operator<<(std::ostream& out, const LoopLevel& level);

}  // namespace retrograde
