// lane_splitter.h -- splits vector expressions by the residue of the lane, for interleave_vectors.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::lower {

// How an expression behaves if it is split into every k-th lane.
struct Pattern {
  enum Kind { Any, Periodic, Whole } kind = Any;  // Whole: splitting costs more than it saves
  int period = 1;                                 // Periodic: the k into which it splits best
  bool has_load = false;
};

inline const Pattern whole_pattern{Pattern::Whole, 1, false};

struct PeriodicIndex;

// Finds the patterns of expressions and splits expressions into parts. Names of vectors have the patterns of their
// values.
class LaneSplitter {
 public:
  Pattern pattern(const Expr& e);

  // The parts of a subtree: interleaved, they equal e.
  std::vector<Expr> parts(const Expr& e, int period);
  void keep_whole(const Expr& e) { patterns_.insert_or_assign(e.get(), Entry{e, whole_pattern}); }

  // Declares that `name`, which is bound to a vector, has pattern `p` and may be split.
  void bind(const std::string& name, const Expr& value, const Pattern& p);
  void bind(const std::string& name, const std::vector<Expr>& part_variables);

 private:
  struct Entry {
    Expr key;
    Pattern pattern;
  };
  struct Named {
    Pattern pattern;
    Expr value;               // recomputed in parts,
    std::vector<Expr> parts;  // unless the parts are bound to names of their own
  };
  Pattern find_pattern(const Expr& e);
  Pattern pattern_of_name(const Variable& n) const;
  Pattern pattern_of_load(const Load& n);
  Expr part(const Expr& e);
  Expr make_part(const Expr& e);

  // A name with fewer parts than the current period: its parts are split further.
  Expr part_of_parts(const std::vector<Expr>& parts, int lanes) const;

  // (base + stride (first + period i)) / c = (base + stride first) / c + (stride period / c) i.
  Expr part_of_index(Kind kind, const PeriodicIndex& index, int lanes) const;
  static Expr make_sequence(const Expr& base, const Expr& stride, int lanes);

  std::unordered_map<const ExprNode*, Entry> patterns_;
  std::unordered_map<std::string, Named> names_;
  int first_ = 0, period_ = 1;
  NodeMemo<Expr> memo_;
};

}  // namespace retrograde::lower
