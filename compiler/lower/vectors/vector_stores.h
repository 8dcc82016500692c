// Stores in a vectorized loop. A store becomes a vector store, a reduction of all lanes, or, where several lanes may
// hit one element, one scalar store per lane in order.
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

// How a loop body uses a buffer.
struct BufferFacts {
  int loads = 0, stores = 0;  // numbers of nodes; a load that a statement shares counts once
  bool is_allocated = false;  // inside the body
  // For stores of the form f[i] = f[i] op g: how often they load f, and which operations they use.
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

  // True once a store that has been visited requires the iterations to run one after the other.
  bool must_stay_serial() const { return must_stay_serial_; }
  // The store for all iterations; undefined if it has to run lane by lane.
  Stmt store(const Stmt& s, const Store& n);
  // An atomic update whose index varies.
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
