// The variables that most tests name.
#pragma once

#include "retrograde/retrograde.h"

namespace retrograde {

inline const Var x("x"), y("y"), z("z"), c("c"), t("t");

}  // namespace retrograde
