// every_kernel.h -- kernels that cover everything a device supports: each kind of IR node and each operator, in every
// type that it takes.
#pragma once

#include <string>
#include <vector>

#include "ir/lowered_function.h"

namespace retrograde::every_kernel {

// All number types and bool.
const std::vector<Type>& types();

// A function with one kernel, named after it, for each kind of node and each operator that devices have. The kernel
// stores its values in every type that it takes, in vectors of `lanes` lanes. `types`: the types that may occur.
ir::LoweredFunction of_everything(int lanes, const std::vector<Type>& types);

// Operations that only a host supports: a function with a kernel that uses it, named after the operator or the node
// kind.
std::vector<ir::LoweredFunction> of_hosts_alone();

// The kinds and operators that are in neither list.
std::vector<std::string> left_out();

}  // namespace retrograde::every_kernel
