// associativity_laws.h -- deciding equations between expressions by cases.
//
// Values are polynomials with integer coefficients over atoms (unknown numbers), or truths. Where
// an expression compares two atoms, or asks for the truth of an unknown condition, the proof
// splits: an equation holds when it holds for every order and truth that do not contradict each
// other.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "ir/expr.h"

namespace retrograde::analysis {

// A sum of products of atoms, each with its coefficient. Coefficients wrap like integers do.
using Monomial = std::vector<int>;  // atoms, sorted; with repetition
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

// What is assumed of the atoms in one case.
class CaseFacts {
 public:
  enum class Order : int8_t { Unknown, Less, Equal, Greater };
  Order order(int a, int b) const;
  // With all that follows. False when it contradicts what is assumed already.
  bool assume(const std::vector<Atom>& atoms, int a, int b, Order order);
  int representative(int atom) const;  // the smallest of the atoms that are equal to it
  std::map<int, bool> truths;

 private:
  std::map<std::pair<int, int>, Order> orders_;
  bool set(int a, int b, Order order);
  bool close(const std::vector<Atom>& atoms);
};

// What stops an evaluation: a question that splits the case, or something it cannot decide.
struct LawQuestion {
  int a = -1, b = -1;   // the order of two atoms; of one, b is -1: its truth
  std::string unknown;  // not empty: no case helps
};

// The value of an expression in one case. Throws LawQuestion.
class LawEvaluator {
 public:
  // `bitwise`: numbers stand for one of their bits, which are truths.
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
  int compare(const Polynomial& a, const Polynomial& b) const;  // < 0, 0, > 0
};

// Whether `claim` holds in all cases. `ignore_ties`: atoms that are compared count as different.
using LawClaim = std::function<bool(LawEvaluator&)>;
bool holds_always(const std::vector<Atom>& atoms, bool bitwise, bool ignore_ties,
                  const LawClaim& claim);

}  // namespace retrograde::analysis
