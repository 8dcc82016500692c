// fork_async -- run async producers concurrently with their consumers.
#pragma once

#include <map>
#include <string>

#include "lower/program.h"

namespace retrograde::lower {

// For each async Func that is stored outside of its compute level: how many iterations its producer may be ahead of its
// consumer; 0: any number.
using AsyncRoom = std::map<std::string, int>;

// Funcs that both branches compute are renamed; the new names are added to those of the program.
Stmt fork_async(const Stmt& s, Program& program, const AsyncRoom& room);

}  // namespace retrograde::lower
