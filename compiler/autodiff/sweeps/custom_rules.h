// custom_rules.h -- runs the rules of custom_derivative.h and checks their results, for both modes.
#pragma once

#include <string>
#include <vector>

#include "autodiff/custom_derivative.h"
#include "autodiff/sweeps/regions.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

// The contents of FuncContents::custom_derivatives; immutable.
struct CustomDerivatives : DerivativeRules {
  std::vector<AdjointInput> adjoint_inputs, tangent_inputs;
  CustomAdjoint adjoint;  // null: none
  CustomTangent tangent;
  ExternReads reads;
};

// The rules of a Func; null: it has none.
std::shared_ptr<const CustomDerivatives> custom_rules_of(const FuncContents& f);
bool has_custom_adjoint(const FuncContents& f);
bool has_custom_tangent(const FuncContents& f);

// The Funcs, images and parameters in the definitions or extern arguments of f, each once, without f itself.
std::vector<std::shared_ptr<Symbol>> read_by(const FuncContents& f);

// A symbol that f depends on along a path that passes none of the inputs. The inputs do not count.
struct Inside {
  std::shared_ptr<Symbol> symbol;
  std::string reader;  // the Func that reads it
};
std::vector<Inside> inside_of(const FuncContents& f, const std::vector<AdjointInput>& inputs);

// The region of an extern stage's argument that the region `of_func` needs.
Box extern_reads(const FuncContents& f, const std::shared_ptr<Symbol>& argument, int dimensions,
                 const Box& of_func);

struct CustomContribution {
  std::shared_ptr<Symbol> input;
  FuncPtr adjoint;
};
struct CustomAdjointResult {
  std::vector<CustomContribution> contributions;  // to wanted inputs, without zeros
  std::vector<std::string> zeros;                 // wanted inputs that were declared zero
  std::vector<FuncPtr> covered;                   // Funcs between the inputs and f
};
// `is_wanted`: the symbol lies between a requested input and the output. `is_requested`: it was requested by name.
CustomAdjointResult run_custom_adjoint(const FuncPtr& f, const FuncPtr& adjoint,
                                       const Regions& regions,
                                       FunctionRef<bool(const Symbol*)> is_wanted,
                                       FunctionRef<bool(const Symbol*)> is_requested);

// `tangent_of` returns null for a zero tangent. `has_direction`: the tangent was specified by the user, not derived.
// Returns null if the tangent is identically zero because nothing that f depends on moves.
FuncPtr run_custom_tangent(const FuncPtr& f, FunctionRef<FuncPtr(const Symbol*)> tangent_of,
                           FunctionRef<bool(const Symbol*)> has_direction);

// Zeros in the shape of an input, named after the input and `suffix`.
FuncPtr zero_derivative(const Symbol& symbol, const std::string& suffix);

}  // namespace retrograde::autodiff
