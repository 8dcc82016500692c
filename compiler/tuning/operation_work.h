// operation_work.h -- what one node of an expression costs, without what it is made from.
#pragma once

#include "tuning/known_value.h"
#include "tuning/work_tree.h"

namespace retrograde::tuning {

// Vectors of the machine that hold a value of the type.
double vectors_of(Type type, int vector_bytes);
Work operation_work(const Expr& e, int vector_bytes);
// Of a load or a store with such lanes. `is_masked`: some lanes may be off.
Work access_work(Type type, const Lanes& lanes, bool is_store, bool is_masked, int vector_bytes);
// A product that the sum of it takes along.
bool is_contracted(const Expr& sum, const Expr& operand);

}  // namespace retrograde::tuning
