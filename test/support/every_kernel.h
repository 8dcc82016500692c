// every_kernel.h -- kernels that cover everything a device supports: each kind of IR node and each operator, in every
// type that it takes.
#pragma once

#include <string>
#include <vector>

#include "ir/lowered_function.h"

namespace retrograde::every_kernel {

// Numbers and truth values.
const std::vector<Type>& types();

// A function with a kernel for each kind of node and each operator that devices have, named after it, which
// stores its values in every type that it takes, in vectors of `lanes` lanes. `types`: those that may occur.
ir::LoweredFunction of_everything(int lanes, const std::vector<Type>& types);

// Operations that only a host supports: a function with a kernel that uses it, named after the operator or the node
// kind.
std::vector<ir::LoweredFunction> of_hosts_alone();

// Kinds and operators of the lists that are in neither.
std::vector<std::string> left_out();

}  // namespace retrograde::every_kernel
