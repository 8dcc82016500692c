// numbers.h -- Python's and NumPy's numbers as constants.
#pragma once

#include <pybind11/pybind11.h>

#include <optional>

#include "ir/expr.h"
#include "ir/scalar.h"

namespace retrograde::python {

namespace py = pybind11;

// bool; int as int32, or the 64-bit type that holds it; float as float32; NumPy's scalars as what they are.
// OverflowError where an int has more than 64 bits.
std::optional<Expr> number_from(py::handle object);
// Whether a plain float that float32 does not hold is a RuntimeWarning where it is rounded to that.
void warn_of_rounding(bool warns);
// A number as a value of a type. OverflowError or TypeError where it cannot be one.
ir::Scalar scalar_of(Type type, py::handle number);
py::object object_of(const ir::Scalar& value);

}  // namespace retrograde::python
