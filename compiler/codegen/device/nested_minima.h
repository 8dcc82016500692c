// nested_minima.h -- works around a bug of ptxas: rewrites PTX so that no signed minimum reads the result of another
// signed minimum. The same holds for maxima.
//
// ptxas combines two such instructions to one with three operands (VIMNMX3, from sm_90 on) and drops the sign of a
// negated operand: min(min(a, -b), c) becomes min(min(a, b), c). Seen with ptxas 13.0 and driver 580.159 on an H200,
// for int32 and int16; reported for ptxas 12.8 to 13.3 on sm_100 (pytorch/pytorch#190973). Unsigned minima are correct.
// So an instruction that reads such a result becomes unsigned: min(a, b) is the unsigned minimum of both with their
// sign bits flipped, with the result's sign bit flipped back.
#pragma once

#include <string>

namespace retrograde::codegen {

std::string rewrite_nested_minima(const std::string& ptx);

}  // namespace retrograde::codegen
