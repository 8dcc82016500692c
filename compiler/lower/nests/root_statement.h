// root_statement.h -- the head of the statement that build_loop_nests gives, for the passes before make_names_unique.
//
//   let out.s0.x.max = ...                                  regions at root, each in terms of those before it
//   evaluate buffer_region<int32>("in", min, max, ...)      what the loops read of an input
//   evaluate buffer_region<int32>("out", min, max, ...)     what they read and write of an output
//   realize ... for ...                                     the loops
//
// add_argument_checks replaces the buffer regions by the checks of these buffers.
#pragma once

#include <map>
#include <string>

#include "analysis/interval.h"
#include "ir/build.h"

namespace retrograde::lower {

struct RootStatement {
  Lets bounds;
  std::map<std::string, Box> regions;  // by buffer; sides may be unbounded
  Stmt loops;
};

Stmt joined(const RootStatement& parts);
RootStatement split_root(const Stmt& s);

// "out" -> [out.min.d, out.min.d + out.extent.d - 1] in every dimension
Box buffer_box(const std::string& buffer, int dimensions);

}  // namespace retrograde::lower
