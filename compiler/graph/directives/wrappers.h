// wrappers.h -- the Funcs that Func::in and clone_in insert between a Func and its consumers.
//
//   g reads f, f.in(g) is w       =>      g reads w, w reads f
//
// The user's definitions never change. `f` records its wrappers by the names of their consumers,
// and compilation starts from a copy of the graph with all references redirected. Wrappers do not
// change values, so whoever only needs values may ignore them.
//
// Programs share images, so images record no wrappers. Each consumer records by their names the
// Funcs that it reads instead of images (copied_inputs).
//
// Ownership: f owns its wrappers, which refer to f weakly. The handles that users get own both.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

// Returns `outputs` unchanged when nothing is wrapped; otherwise outputs of a copy of the graph in
// which consumers read wrappers. CompileError when a Func is wrapped in another that does not read
// it.
std::vector<FuncPtr> apply_wrappers(const std::vector<FuncPtr>& outputs);

// Every Func that compiling the outputs reads, wrappers included, in no particular order.
std::vector<FuncPtr> functions_of(const std::vector<FuncPtr>& outputs);

// The wrapper of f that all of `users` share, created if necessary. No users: the wrapper for all
// consumers without another one. `clone`: a copy of f instead of a Func that reads it.
FuncPtr wrapper_of(const FuncPtr& f, const std::vector<FuncPtr>& users, const std::string& name,
                   bool clone);

// A copy of the definitions and schedule under another name.
FuncPtr clone_of(const FuncPtr& f, const std::string& name);

// The Func through which `user` reads the image, created if necessary.
FuncPtr copied_input(const FuncPtr& user, const std::shared_ptr<ParameterContents>& image,
                     const std::string& name);

// The Func that reads an image point by point; the same one for each call.
FuncPtr func_of_image(const std::shared_ptr<ParameterContents>& image);

}  // namespace retrograde::graph
