// Stores of a vectorized loop: of vectors, of what all iterations add up, of one lane after the other
// where several may hit one element.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "lower/vectors/reductions.h"
#include "lower/vectors/widen_expr.h"

namespace retrograde::lower {

// What a loop body does to a buffer.
struct BufferFacts {
  int loads = 0, stores = 0;  // nodes that load, counted once per statement
  bool is_allocated = false;  // inside the body
  // Of stores f[i] = f[i] op g: their loads of f, and which operations there are.
  int update_loads = 0;
  std::set<std::pair<Kind, Op>> update_operations;
};
struct BodyFacts {
  std::unordered_map<std::string, BufferFacts> buffers;
  std::unordered_set<std::string> produced;  // Funcs computed inside the body
};

class VectorStores {
 public:
  VectorStores(const For& loop, Widener& widen, FreshNames& fresh);

  // Whether the iterations must run one after the other, by what has been stored so far.
  bool must_stay_serial() const { return must_stay_serial_; }
  // For all iterations; undefined: it has to run lane by lane.
  Stmt store(const Stmt& s, const Store& n);
  // One operation on elements whose place varies.
  Stmt atomic_update(const Store& n);

 private:
  std::optional<AtomicUpdate> as_plain_update(const Store& n) const;
  Stmt update_in_order(const Store& n, const Expr& index, const AtomicUpdate& update);
  void require_no_load(const std::string& buffer, int own);
  Stmt store_reduction(const Stmt& s, const Store& n, const UpdateChain& reduction);
  Expr reduce(Kind kind, const Expr& term, const Expr& active);

  const std::string name_;  // of the loop
  Widener& widen_;
  FreshNames& fresh_;
  BodyFacts facts_;
  bool must_stay_serial_;
};

}  // namespace retrograde::lower
