// associativity_laws.h -- decides equations between expressions by case distinction.
//
// Values are polynomials with integer coefficients over atoms (unknown numbers), or truth values.
// Where an expression compares two atoms or needs the truth of an unknown condition, the proof
// splits into cases. An equation holds when it holds in every consistent case.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "ir/expr.h"

namespace retrograde::analysis {

// A sum of products of atoms with coefficients, which wrap like integers.
using Monomial = std::vector<int>;  // atoms, sorted, possibly repeated
using Polynomial = std::map<Monomial, int64_t>;

struct LawValue {
  bool is_truth = false;
  bool truth = false;
  Polynomial number;
};
using LawEnvironment = std::map<std::string, LawValue>;

struct Atom {
  enum class Kind : uint8_t { Number, Highest, Lowest, Truth };
  Kind kind = Kind::Number;
};

// The assumptions about the atoms in one case.
class CaseFacts {
 public:
  enum class Order : int8_t { Unknown, Less, Equal, Greater };
  Order order(int a, int b) const;
  // Adds an assumption and its consequences. False when it contradicts earlier ones.
  bool assume(const std::vector<Atom>& atoms, int a, int b, Order order);
  int representative(int atom) const;  // the smallest of the atoms that are equal to it
  std::map<int, bool> truths;

 private:
  std::map<std::pair<int, int>, Order> orders_;
  bool set(int a, int b, Order order);
  bool close(const std::vector<Atom>& atoms);
};

// Thrown to stop an evaluation: a question on which the case must split, or an undecidable one.
struct LawQuestion {
  int a = -1, b = -1;   // the order of two atoms; with b == -1 the truth of one
  std::string unknown;  // if not empty, no case helps
};

// Evaluates an expression in one case. Throws LawQuestion.
class LawEvaluator {
 public:
  // `bitwise`: each number represents one of its bits, as a truth value.
  LawEvaluator(const CaseFacts& facts, bool bitwise) : facts_(facts), bitwise_(bitwise) {}
  LawValue value(const Expr& e, const LawEnvironment& environment);
  LawValue atom(int index, Atom::Kind kind) const;
  bool equal(const LawValue& a, const LawValue& b) const;

 private:
  const CaseFacts& facts_;
  const bool bitwise_;
  const LawEnvironment* environment_ = nullptr;
  std::unordered_map<const ExprNode*, LawValue> memo_;

  const LawValue& get(const Expr& e);
  LawValue evaluate(const Expr& e);
  LawValue binary(const Binary& e);
  LawValue call(const Call& call);
  LawValue constant(const Expr& e, double real, int64_t integer) const;
  bool truth(const Expr& e);
  const Polynomial& number(const Expr& e);
  int compare(const Polynomial& a, const Polynomial& b) const;  // negative, 0 or positive
};

// Whether `claim` holds in all cases. `ignore_ties`: compared atoms are assumed to differ.
using LawClaim = std::function<bool(LawEvaluator&)>;
bool holds_always(const std::vector<Atom>& atoms, bool bitwise, bool ignore_ties,
                  const LawClaim& claim);

}  // namespace retrograde::analysis
