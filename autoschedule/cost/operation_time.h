// operation_time.h -- what one operation costs on one core.
#pragma once

#include <string>

#include "autoschedule/machine/machine.h"
#include "ir/type.h"

namespace retrograde::planning {

// Nanoseconds of one operation with independent ones around it.
struct OperationTime {
  double vector_ns = 0;  // of a vector as wide as the machine's
  double scalar_ns = 0;
  bool is_integer = false;  // a scalar is computed beside vectors, by other units
};

// `name`: of a kind of node or of an operator, as OperationCount has it.
OperationTime operation_time(const std::string& name, Type type, const Machine& machine);

}  // namespace retrograde::planning
