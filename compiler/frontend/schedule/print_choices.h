// print_choices.h -- targets, codes of types, and what schedules choose among, as text:
// std::cout << tail.
#pragma once

#include <iosfwd>

#include "frontend/schedule/loop_level.h"
#include "graph/schedule.h"
#include "ir/target.h"

namespace retrograde {

// Enumerators by their names in C++; a target as target(x86-64-linux-avx2), as Halide writes it.
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
