// every_kernel.h -- kernels that have everything which the language can ask of a device, by the IR's own
// lists: each kind of node and each operator, in every type that it takes.
#pragma once

#include <string>
#include <vector>

#include "ir/lowered_function.h"

namespace retrograde::every_kernel {

// Numbers and truth values.
const std::vector<Type>& types();

// A function with a kernel for each kind of node and each operator that devices have, named after it, which
// stores its values in every type that it takes, in vectors of so many lanes. `types`: those that may occur.
ir::LoweredFunction of_everything(int lanes, const std::vector<Type>& types);

// What only a host can do: a function with a kernel that does it, each named after the operator or the kind.
std::vector<ir::LoweredFunction> of_hosts_alone();

// Kinds and operators of the lists that are in neither.
std::vector<std::string> left_out();

}  // namespace retrograde::every_kernel
