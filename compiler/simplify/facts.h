// Facts known during simplification: bounds of variables, conditions that hold, and the bounds of
// sums that follow from them.
#pragma once

#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "ir/interval.h"
#include "ir/node_memo.h"
#include "ir/sum.h"
#include "simplify/constant_range.h"

namespace retrograde::simplification {

// An integer known to be modulus * k + remainder for some k. Modulus 0 means the constant
// `remainder`; modulus 1 means that nothing is known.
struct Congruence {
  int64_t modulus = 1, remainder = 0;
  // The value modulo a positive divisor, if it is the same for all possible values.
  std::optional<int64_t> modulo(int64_t divisor) const;
};

class Facts {
 public:
  // Declares a variable with simplified ends (undefined: unknown). The ends of later variables may
  // mention earlier ones, but not vice versa.
  void bind(const std::string& name, Expr min, Expr max);
  void unbind(const std::string& name);
  // The value of a name whose ends are equal; else undefined.
  Expr value_of(const std::string& name) const;
  // The lower end of a name; undefined when unknown.
  Expr min_of(const std::string& name) const;

  // Assumes a simplified condition during its lifetime. Splits conjunctions.
  class Assumption {
   public:
    Assumption(Facts& facts, const Expr& condition);
    ~Assumption();
    Assumption(const Assumption&) = delete;
    Assumption& operator=(const Assumption&) = delete;

   private:
    Facts& facts_;
    size_t first_, first_congruent_, first_narrowed_;
  };
  // Assumes the condition until the enclosing Assumption ends, or forever.
  void assume(const Expr& condition);
  // The truth of the condition if it or its negation was assumed.
  std::optional<bool> decided(const Expr& condition) const;

  ConstantRange range(const Expr& e);  // See ranges.cpp.
  // See congruence.cpp.
  Congruence congruence(const Expr& e);
  Congruence congruence(const Sum& sum);
  // The tightest constant bounds found for a sum of an index type. See bounds_of_sums.cpp.
  int64_t upper_bound(const Sum& sum);
  int64_t lower_bound(const Sum& sum);
  // The same, and it multiplies the sum by divisors to compare quotients of different sums. Takes longer.
  int64_t upper_bound_of_quotients(const Sum& sum);
  // Drops the memoised ranges; call it when variables or conditions change.
  void forget() {
    ranges_.clear();
    congruences_.clear();
  }

 private:
  struct Bounds : Interval {
    ConstantRange range;
    Congruence congruence;  // of a variable with one value
    int order;              // order of binding; inner variables are eliminated first
  };
  // A known fact: a sum is at most `bound`, or a condition is true or false.
  struct Known {
    std::vector<Term> terms;
    int64_t bound = 0;
    Expr condition;
    bool value = true;
  };
  // The earlier bounds of a variable that a condition has narrowed.
  struct Narrowed {
    std::string name;
    Bounds before;
  };
  // A congruence of a variable that a condition implies.
  struct Congruent {
    std::string name;
    Congruence congruence;
  };

  void assume(const Expr& condition, bool value);
  void assume_comparison(const Binary& comparison, bool value);
  void assume_at_most(Sum sum, int64_t bound);
  void narrow(const Expr& low, const Expr& high, int64_t gap);
  bool is_older(const Expr& e, int order) const;
  void assume_congruent(const Expr& remainder, const Expr& value);
  void add(uint64_t key, Known known);
  int64_t known_bound(const Sum& sum) const;
  int64_t known_bound(const Expr& atom, int64_t factor) const;

  ConstantRange range_of_node(const Expr& e);
  ConstantRange range_of_variable(const Expr& e, const Variable& n);
  ConstantRange range_of_binary(const Binary& n);
  ConstantRange range_of_remainder(const Binary& n);
  ConstantRange range_of_call(const Call& n);
  Congruence congruence_of_node(const Expr& e);
  Congruence congruence_of_variable(const Variable& n);

  // How many more replacements a search may make, and whether it multiplies sums by divisors.
  struct Effort {
    int replacements;
    bool multiplies;
  };
  int64_t search(const Sum& sum, Effort& effort);
  int64_t bound_by_ranges(const Sum& sum);
  int64_t replace(const Sum& sum, const Term& term, const Expr& by, Effort& effort);
  int64_t eliminate_structure(const Sum& sum, Effort& effort);
  int64_t eliminate_division(const Sum& sum, const Term& term, const Div& n, Effort& effort);
  int64_t eliminate_variable(const Sum& sum, Effort& effort);

  std::unordered_map<std::string, Bounds> variables_;
  std::vector<Known> known_;
  std::vector<Congruent> congruent_;
  std::vector<Narrowed> narrowed_;
  std::unordered_multimap<uint64_t, size_t>
      index_;  // hash of the terms or condition -> position in known_
  NodeMemo<ConstantRange> ranges_;
  NodeMemo<Congruence> congruences_;
  int next_order_ = 0;
};

}  // namespace retrograde::simplification
