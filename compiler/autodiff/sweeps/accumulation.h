// From contributions to a Func: the adjoint of one target.
//
// Contributions that reach each element at most once make the pure definition, a sum. The others
// become update definitions, which those share that can (taps.h); so do short gathers whose
// predicates differ in borders alone: these become selects. Who owns an element:
//   gather      each element is written by the iterations of its own pure variables only: race-free
//               in parallel.
//   scatter     an index depends on data: serial inside each element of the pure dimensions; places
//               and terms are computed in vectors.
//   privatised  few elements are left to run over in parallel: a fixed number of parts of the
//               outermost reduction variable, and lanes of the innermost, accumulate apart in a
//               Func of their own, and are then summed in order. Lanes alone where the elements are
//               more, in rows shorter than a vector. A scatter has lanes where its elements are
//               few. The parts are as many as fit a budget of bytes, whatever the number of
//               threads, on which the result does not depend. Where fewer than four fit, a scatter
//               (private_parts.h).
//
// Long sums. Adding n float32 terms one after the other may lose log2(n) bits: 12 million times 0.1
// is wrong by a tenth. An adjoint in float32 that sums many_terms iterations or more for an element
// (or an unknown number, or whatever a scatter brings to it) is accumulated in double, private
// parts included, by a Func of its own, f_adj_sum, and is rounded once: f_adj(y) =
// float(f_adj_sum(y)). Gathers bring it their terms in short blocks of float32 (blocked_sums.h). So
// the error is that of the terms and at most 1e-6 of the sum of their absolute values, under every
// schedule, and but for a block only the result can overflow. Compensated sums in float32 would cost
// four dependent additions a term and break under reassociation by rfactor; a tree costs storage.
// Shorter sums stay in float32: gathers over stencils and small kernels, at most many_terms * 2^-24
// of the sum of absolute values wrong.
#pragma once

#include <string>
#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "graph/function.h"

namespace retrograde::autodiff {

struct Contribution {
  int component = 0;
  Gather gather;
  Expr adjoint;  // over the gather's variables
};

struct AdjointTarget {
  std::string name;               // of the primal
  std::vector<std::string> args;  // pure variables of the adjoint
  std::vector<Type> types;        // of the adjoint, one a value
  std::vector<LoopVariable> region;
};

// Iterations from which float32 terms are summed in double.
inline constexpr int many_terms = 4096;

enum class Accumulation : uint8_t { Pointwise, Gather, Scatter, Privatised };

struct AdjointFunc {
  FuncPtr func;
  std::vector<FuncPtr> helpers;      // private parts, then the accumulator
  FuncPtr accumulator;               // sums in double what func rounds; null: func itself
  std::vector<Accumulation> stages;  // how each stage of func accumulates; the first is Pointwise
  std::vector<std::string> notes;    // what private parts take
};

// `initial`: values that the pure definition starts from, empty for zeros.
AdjointFunc make_adjoint(const AdjointTarget& target, const std::string& name,
                         const std::vector<Contribution>& contributions,
                         const std::vector<Expr>& initial = {});

}  // namespace retrograde::autodiff
