// shifted_renaming.h -- equality of statements up to names and to constant distances in memory.
//
//   ray_3[i] = way(curv[2], idx[2], idx[3])    stands for    ray_4[i] = way(curv[3], idx[3], idx[4])
//
// with ray_4 for ray_3, curv + 1 for curv and idx + 1 for idx. Steps that a program unrolls differ in this way if they
// read parameters or a signal by the number of the step.
#pragma once

#include "ir/equal.h"

namespace retrograde::ir {

struct Shift {
  int64_t elements = 0;
  Type type;  // of an element
};
struct ShiftedRenaming {
  Renaming names;
  // For memory of the first statement: element k stands for element k + shift of the memory of the other. Without those
  // of distance 0.
  std::unordered_map<std::string, Shift> shifts;
};

// Like renaming() of ir/equal.h; all indices of one memory have the same distance.
std::optional<ShiftedRenaming> shifted_renaming(const Stmt& a, const Stmt& b,
                                                const Renaming& known = {});

// The index with a constant added, inside of ramps and broadcasts.
Expr shifted_index(const Expr& index, int64_t elements);

}  // namespace retrograde::ir
