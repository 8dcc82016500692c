// What is known while simplifying: bounds of variables, conditions that hold, and what follows for
// a sum.
#pragma once

#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "ir/interval.h"
#include "ir/node_memo.h"
#include "ir/sum.h"

namespace retrograde::simplification {

// Of the values of a type.
ConstantRange range_of(Type type);
ConstantRange operator+(const ConstantRange& a, const ConstantRange& b);
ConstantRange operator*(const ConstantRange& a, int64_t factor);

// Of an integer: modulus * k + remainder, for some k; modulus 0 makes it that number, modulus 1
// says nothing.
struct Congruence {
  int64_t modulus = 1, remainder = 0;
  // The value modulo a positive divisor, when all that it may be agree on that.
  std::optional<int64_t> modulo(int64_t divisor) const;
};

class Facts {
 public:
  // Simplified ends; undefined: unknown. Later variables may mention earlier ones in their bounds,
  // not vice versa.
  void bind(const std::string& name, Expr min, Expr max);
  void unbind(const std::string& name);
  // Of a name whose ends are the same; else undefined.
  Expr value_of(const std::string& name) const;
  // The lower end of a name; undefined where unknown.
  Expr min_of(const std::string& name) const;

  // While alive, the condition (simplified) holds. Takes conjunctions apart.
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
  // Until the end of time (or of an enclosing Assumption).
  void assume(const Expr& condition);
  // Whether the condition itself, or its negation, was assumed.
  std::optional<bool> decided(const Expr& condition) const;

  ConstantRange range(const Expr& e);
  // See congruence.cpp.
  Congruence congruence(const Expr& e);
  Congruence congruence(const Sum& sum);
  // The tightest constants found around a sum of an index type.
  int64_t upper_bound(const Sum& sum);
  int64_t lower_bound(const Sum& sum);
  // Ranges of expressions are remembered; to be called when variables or conditions change.
  void forget() {
    ranges_.clear();
    congruences_.clear();
  }

 private:
  struct Bounds : Interval {
    ConstantRange range;
    Congruence congruence;  // of a variable with one value
    int order;              // of binding: inner variables are eliminated first
  };
  // A fact is a sum that is at most `bound`, or a condition known to be true or false.
  struct Known {
    std::vector<Term> terms;
    int64_t bound = 0;
    Expr condition;
    bool value = true;
  };
  // What was known of a variable before a condition said more.
  struct Narrowed {
    std::string name;
    Bounds before;
  };
  // A variable that a condition says so of.
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
  ConstantRange range_of_call(const Call& n);
  Congruence congruence_of_node(const Expr& e);
  Congruence congruence_of_variable(const Variable& n);

  int64_t search(const Sum& sum, int& budget);
  int64_t bound_by_ranges(const Sum& sum);
  int64_t replace(const Sum& sum, const Term& term, const Expr& by, int& budget);
  int64_t eliminate_structure(const Sum& sum, int& budget);
  int64_t eliminate_division(const Sum& sum, const Term& term, const Div& n, int& budget);
  int64_t eliminate_variable(const Sum& sum, int& budget);

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
