// directive_choices.h -- the names of the enumerators that directives take, as spelled in C++.
#pragma once

#include <array>
#include <type_traits>

#include "graph/schedule.h"

namespace retrograde::graph {

inline constexpr std::array tail_choices{"RoundUp",
                                         "GuardWithIf",
                                         "Predicate",
                                         "PredicateLoads",
                                         "PredicateStores",
                                         "RoundUpAndBlend",
                                         "ShiftInwardsAndBlend",
                                         "ShiftInwards",
                                         "Auto"};
inline constexpr std::array loop_choices{"Serial",   "Parallel",  "Vectorized", "Unrolled",
                                         "GpuBlock", "GpuThread", "GpuLane"};
inline constexpr std::array partition_choices{"Auto", "Never", "Always"};
inline constexpr std::array memory_choices{"Auto",        "Heap",      "Stack",
                                           "Register",    "GPUShared", "GPUTexture",
                                           "LockedCache", "VTCM",      "AMXTile"};
inline constexpr std::array align_choices{"AlignStart", "AlignEnd", "NoAlign", "Auto"};
inline constexpr std::array prefetch_choices{"Clamp", "GuardWithIf", "NonFaulting"};

// An enumeration's name and the names of its enumerators.
template <typename E>
struct Choices;
#define RETROGRADE_CHOICES(E, names_)            \
  template <>                                    \
  struct Choices<E> {                            \
    static constexpr const char* name = #E;      \
    static constexpr const auto& names = names_; \
  };
RETROGRADE_CHOICES(TailStrategy, tail_choices)
RETROGRADE_CHOICES(ForType, loop_choices)
RETROGRADE_CHOICES(Partition, partition_choices)
RETROGRADE_CHOICES(MemoryType, memory_choices)
RETROGRADE_CHOICES(LoopAlignStrategy, align_choices)
RETROGRADE_CHOICES(PrefetchBoundStrategy, prefetch_choices)
#undef RETROGRADE_CHOICES

template <typename T>
concept Enumeration = std::is_enum_v<T>;

template <Enumeration E>
const char* choice_name(E value) {
  return Choices<E>::names[static_cast<size_t>(value)];
}

}  // namespace retrograde::graph
