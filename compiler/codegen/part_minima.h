// part_minima.h -- PTX without a minimum of a minimum, or a maximum of a maximum, of signed integers.
//
// For two such instructions ptxas takes one of three operands (VIMNMX3, from sm_90 on) and drops the sign of an
// operand that is a negation: min(min(a, -b), c) becomes min(min(a, b), c). Seen with ptxas 13.0 and the driver
// 580.159 on an H200, for int32 and int16; reported of ptxas 12.8 to 13.3 for sm_100 (pytorch/pytorch#190973).
// Unsigned minima are right, so every second one of a chain is one: min(a, b) is the unsigned minimum of both with
// their sign bits turned, its own turned back.
#pragma once

#include <string>

namespace retrograde::codegen {

std::string part_minima(const std::string& ptx);

}  // namespace retrograde::codegen
