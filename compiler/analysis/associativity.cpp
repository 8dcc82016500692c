#include "analysis/associativity.h"

namespace retrograde::ir {

AssociativityProof prove_associative(const std::vector<Expr>&, const std::vector<std::string>&) {
  AssociativityProof proof;
  proof.why_not = "no proof was found";
  return proof;
}

}  // namespace retrograde::ir
