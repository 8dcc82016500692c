// wrappers.h -- the Funcs that Func::in and clone_in put between a Func and its users.
//
//   g reads f, f.in(g) is w       =>      g reads w, w reads f
//
// A user's definitions never change: `f` keeps its wrappers by the names of the users, and
// compiling starts by copying the graph with all references redirected. Values stay the same, so
// what evaluates or differentiates definitions need not know of wrappers.
//
// Images have no place for that, since programs share them: a user keeps by their names what it reads
// in their stead (copied_inputs).
//
// Ownership: f owns its wrappers, and they refer to f weakly. The handles that users get own both.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

// `outputs` as they are when nothing is wrapped; otherwise outputs of a copy of the graph, in which
// users read wrappers. CompileError when a Func is wrapped in another that does not read it.
std::vector<FuncPtr> apply_wrappers(const std::vector<FuncPtr>& outputs);

// Every Func that compiling the outputs looks at, wrappers included; in no particular order.
std::vector<FuncPtr> functions_of(const std::vector<FuncPtr>& outputs);

// The wrapper of f that all of `users` share, made when there is none; no users: all that have no
// other. `clone`: a copy of f instead of a Func that reads it.
FuncPtr wrapper_of(const FuncPtr& f, const std::vector<FuncPtr>& users, const std::string& name,
                   bool clone);

// The same definitions and schedule under another name.
FuncPtr clone_of(const FuncPtr& f, const std::string& name);

// The Func through which `user` reads the image, made when there is none.
FuncPtr copied_input(const FuncPtr& user, const std::shared_ptr<ParameterContents>& image,
                     const std::string& name);

// The Func that reads an image point by point, the same for each call.
FuncPtr func_of_image(const std::shared_ptr<ParameterContents>& image);

}  // namespace retrograde::graph
