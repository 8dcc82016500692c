// element_values.h -- the values of a pure Func at elements, as expressions.
//
//   ray(i) = {a(i) + b(i), a(i) * b(i)}        values at j: a(j) + b(j) and a(j) * b(j), with one a(j) and one b(j)
//
// Values at one element share their nodes. Without that, each level of a chain of Tuples with k values would be copied k
// times for the next one: k^n nodes for n levels.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "graph/function.h"
#include "ir/visit.h"

namespace retrograde::graph {

class ElementValues {
 public:
  ElementValues(std::vector<std::string> args, std::vector<Expr> values)
      : args_(std::move(args)), values_(std::move(values)) {}

  // Value `component` at the element.
  Expr at(const std::vector<Expr>& element, int component);

 private:
  struct Element {
    std::vector<Expr> place;
    std::unique_ptr<StepRewriter> values;  // remembers the nodes that it has made
  };
  Substitution substitution_to(const std::vector<Expr>& element) const;

  std::vector<std::string> args_;
  std::vector<Expr> values_;
  std::deque<Element> recent_;  // the last few elements
};

// The elements that calls have read so far.
class SeenElements {
 public:
  // Whether this call is the first to read its element.
  bool is_first(const Expr& call);

 private:
  std::unordered_map<size_t, std::vector<Expr>> calls_;  // by the hash of the element
};

}  // namespace retrograde::graph
