// Running the rules of custom_derivative.h and checking what they give: what the two syntheses see
// of them.
#pragma once

#include <string>
#include <vector>

#include "autodiff/custom_derivative.h"
#include "autodiff/sweeps/regions.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

// What FuncContents::custom_derivatives points to. Never changed once it is there.
struct CustomDerivatives {
  std::vector<AdjointInput> adjoint_inputs, tangent_inputs;
  CustomAdjoint adjoint;  // null: none
  CustomTangent tangent;
  ExternReads reads;
};

bool has_custom_adjoint(const FuncContents& f);
bool has_custom_tangent(const FuncContents& f);

// Funcs, images and parameters that the definitions or the extern arguments of f name, each once;
// f is not among them.
std::vector<std::shared_ptr<Symbol>> read_by(const FuncContents& f);

// What f depends on by a path that passes none of the inputs, which are not among it.
struct Inside {
  std::shared_ptr<Symbol> symbol;
  std::string reader;  // who names it
};
std::vector<Inside> inside_of(const FuncContents& f, const std::vector<AdjointInput>& inputs);

// The region of an extern stage's argument that `of_func` needs.
Box extern_reads(const FuncContents& f, const std::shared_ptr<Symbol>& argument, int dimensions,
                 const Box& of_func);

struct CustomContribution {
  std::shared_ptr<Symbol> input;
  FuncPtr adjoint;
};
struct CustomAdjointResult {
  std::vector<CustomContribution> contributions;  // to wanted inputs, without zeros
  std::vector<std::string> zeros;                 // wanted inputs that were declared zero
  std::vector<FuncPtr> covered;                   // between the inputs and f
};
// is_wanted: lies between what was requested and the output; is_requested: by name.
CustomAdjointResult run_custom_adjoint(const FuncPtr& f, const FuncPtr& adjoint,
                                       const Regions& regions,
                                       FunctionRef<bool(const Symbol*)> is_wanted,
                                       FunctionRef<bool(const Symbol*)> is_requested);

// tangent_of: null where it is zero. has_direction: it was given, not derived. Null: identically
// zero, as nothing that f depends on moves.
FuncPtr run_custom_tangent(const FuncPtr& f, FunctionRef<FuncPtr(const Symbol*)> tangent_of,
                           FunctionRef<bool(const Symbol*)> has_direction);

// Zeros in the shape of an input, under its name and `suffix`.
FuncPtr zero_derivative(const Symbol& symbol, const std::string& suffix);

}  // namespace retrograde::autodiff
