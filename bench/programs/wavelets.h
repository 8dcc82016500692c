// wavelets.h -- Daubechies' orthogonal wavelets with 4 coefficients (1988).
#pragma once

#include "program.h"

namespace programs {

inline constexpr float daubechies[4] = {0.48296291f, 0.83651630f, 0.22414387f, -0.12940952f};

}  // namespace programs
