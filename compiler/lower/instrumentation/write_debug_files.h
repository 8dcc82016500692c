// write_debug_files -- write the values of Funcs to files, for Func::debug_to_file.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

Stmt write_debug_files(const Stmt& s, const Program& program);

}  // namespace retrograde::lower
