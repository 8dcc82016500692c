// language.h -- defines `lang`, the language with which this translation unit is compiled.
//
// model.cpp and trainer.cpp are compiled twice from the same source: with Retrograde for the program, and with Halide
// 14 for the peer against which it is measured. So both optimize the same function.
#pragma once

#ifdef BILATERAL_SLICE_WITH_HALIDE
#include <Halide.h>
namespace lang = Halide;
#else
#include <retrograde/retrograde.h>
namespace lang = retrograde;
#endif
