// fork_async -- producers that run at the same time as their consumers.
#pragma once

#include <map>
#include <string>

#include "lower/program.h"

namespace retrograde::lower {

// By Func: how many iterations its producer may be ahead of its consumer; 0: any number. Only of
// async Funcs that are stored outside of where they are computed.
using AsyncRoom = std::map<std::string, int>;

// Funcs that both branches compute get new names, which are added to those of the program.
Stmt fork_async(const Stmt& s, Program& program, const AsyncRoom& room);

}  // namespace retrograde::lower
