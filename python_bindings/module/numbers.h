// numbers.h -- converts Python's and NumPy's numbers to constants.
#pragma once

#include <pybind11/pybind11.h>

#include <optional>

#include "ir/expr.h"
#include "ir/scalar.h"

namespace retrograde::python {

namespace py = pybind11;

// A number as a constant. bool is bool, int is int32 or the 64-bit type that holds it, and float is float32. NumPy's
// scalars keep their types. Throws OverflowError if an int has more than 64 bits.
std::optional<Expr> number_from(py::handle object);
// Chooses whether rounding a plain float to float32 raises a RuntimeWarning if the value changes.
void warn_of_rounding(bool warns);
// A number as a value of a type. Throws OverflowError or TypeError if it does not fit.
ir::Scalar scalar_of(Type type, py::handle number);
py::object object_of(const ir::Scalar& value);

}  // namespace retrograde::python
