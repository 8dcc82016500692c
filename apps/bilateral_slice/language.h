// language.h -- `lang` is the language that this translation unit is compiled with.
//
// model.cpp and trainer.cpp are compiled twice from the same text: with Retrograde for the program,
// and with Halide 14 for the peer that it is measured against. So both optimize the same function.
#pragma once

#ifdef BILATERAL_SLICE_WITH_HALIDE
#include <Halide.h>
namespace lang = Halide;
#else
#include <retrograde/retrograde.h>
namespace lang = retrograde;
#endif
