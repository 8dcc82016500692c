// accumulation.h -- builds the adjoint of one Func, image or parameter from its contributions.
//
// Contributions that reach each element at most once are summed in the pure definition. The others become update
// definitions; contributions that can share an update do (taps.h). Gathers whose indices divide by a stride are summed
// by its phases, in a Func of their own that the pure definition reads (phases.h). Short gathers whose predicates differ
// only at borders are merged, too: their predicates become selects. Each kind of accumulation owns its elements as
// follows.
//   gather      Iterations of an element's own pure variables write it, so parallel loops over these are race-free.
//   scatter     An index depends on data. Iterations run serially for each element of the pure dimensions; indices and
//               terms are computed in vectors.
//   privatised  Too few elements to run over in parallel. A fixed number of parts of the outermost reduction variable,
//               and vector lanes of the innermost, accumulate in privatised copies in a Func of their own, which are
//               then summed in order. If there are many elements, in rows shorter than a vector, only lanes get copies.
//               A scatter gets lanes if it has few elements. The number of parts is limited by a budget in bytes and
//               does not depend on the number of threads, so the result does not, either. If fewer than four parts fit,
//               a scatter stays a scatter (privatisation.h).
//
// Long sums. Adding n float32 terms in sequence may lose log2(n) bits: the sum of 12 million times 0.1 is wrong by a
// tenth. A float32 adjoint is accumulated in double, privatised copies included, if an element sums many_terms
// iterations or more, an unknown number of iterations, or a scatter. A Func f_adj_sum holds the sum and is rounded
// once: f_adj(y) = float(f_adj_sum(y)). Gathers add their terms in short float32 blocks first (blocked_sums.h). The
// result is wrong by the errors of the terms plus at most 1e-6 of the sum of their absolute values, under every
// schedule. Apart from the blocks, only the result can overflow.
//
// Rejected: compensated sums in float32 cost four dependent additions a term and break when rfactor reassociates them;
// a tree of partial sums costs storage. Shorter sums, as of stencils and small kernels, stay in float32: they are wrong
// by at most many_terms * 2^-24 of the sum of absolute values.
#pragma once

#include <string>
#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "graph/function.h"

namespace retrograde::autodiff {

struct Contribution {
  int component = 0;
  Gather gather;
  Expr adjoint;  // in terms of the gather's variables
};

struct AdjointTarget {
  std::string name;               // name of the primal
  std::vector<std::string> args;  // pure variables of the adjoint
  std::vector<Type> types;        // of the adjoint, one for each value
  std::vector<LoopVariable> region;
};

// Sums of at least this many float32 terms are accumulated in double.
inline constexpr int many_terms = 4096;

enum class Accumulation : uint8_t { Pointwise, Gather, Scatter, Privatised };

struct AdjointFunc {
  FuncPtr func;
  std::vector<FuncPtr> helpers;      // privatised copies, then the accumulator
  FuncPtr accumulator;               // the sum in double that func rounds; null: func itself
  std::vector<Accumulation> stages;  // how each stage of func accumulates; the first is Pointwise
  std::vector<std::string> notes;    // memory taken by privatised copies
};

// `initial` are the values that the pure definition starts from; empty means zeros.
AdjointFunc make_adjoint(const AdjointTarget& target, const std::string& name,
                         const std::vector<Contribution>& contributions,
                         const std::vector<Expr>& initial = {});

}  // namespace retrograde::autodiff
