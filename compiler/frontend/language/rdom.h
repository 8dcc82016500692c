// rdom.h -- reduction domains: the loops of an update definition.
//
// RDom r(0, width, 0, height); r.where(r.x < r.y); f(x) += g(x + r.x, r.y);
// The first variable is the innermost loop. Points at which a predicate is false are skipped.
#pragma once

#include <concepts>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "frontend/language/var.h"
#include "graph/function.h"

namespace retrograde {

using Region = std::vector<Range>;  // min and extent of each dimension

class OutputImageParam;
template <typename T, int Dims>
class Buffer;

// One variable of a reduction domain. An RVar that is constructed from a name alone denotes a loop in a
// schedule, as in f.update().split(r.x, outer, inner, 8).
class RVar {
 public:
  RVar();  // a generated name
  explicit RVar(const std::string& name);
  template <frontend::TextPointer T>
  explicit RVar(const T& name) : RVar(frontend::name_from(name, "an RVar")) {}
  explicit RVar(std::nullptr_t) = delete;
  // Variable `index` of a domain.
  RVar(std::shared_ptr<graph::ReductionDomainContents> domain, int index);

  const std::string& name() const { return name_; }  // the name of its loop
  // First value of its range.
  // Requires: only a variable of an RDom has a range.
  Expr min() const;
  Expr extent() const;    // number of values in its range
  operator Expr() const;  // the variable as an Expr
  // The domain that it belongs to, or null.
  const std::shared_ptr<graph::ReductionDomainContents>& domain() const { return domain_; }

 private:
  const graph::ReductionVariable& variable(const char* asked) const;
  std::string name_;
  std::shared_ptr<graph::ReductionDomainContents> domain_;
  int index_ = -1;
};

// A reduction domain: a box over which an update iterates in order, optionally narrowed by predicates.
class RDom {
 public:
  RDom() = default;  // an undefined handle
  // A domain with a (min, extent) for each variable.
  // Requires: a reduction domain has at least one variable; its min must be a defined expression;
  // its extent must be an integer; its bounds must be known before any loop starts; an extent is
  // not negative.
  RDom(const Region& region, const std::string& name = "");
  RDom(const Region& region, std::nullptr_t) = delete;
  RDom(std::initializer_list<Range> region) : RDom(Region(region)) {}
  // A domain from (min, extent) pairs and an optional name: RDom r(0, 3, 0, 3, "r").
  template <typename... Args>
  RDom(Expr min, Expr extent, Args&&... rest) {
    Region region{{std::move(min), std::move(extent)}};
    collect(region, std::forward<Args>(rest)...);
  }
  // The domain of all elements of a buffer.
  template <typename T, int Dims>
  RDom(const Buffer<T, Dims>& buffer);  // all of its elements
  RDom(const OutputImageParam& image);
  // A handle to an existing domain. The constraint excludes braced lists, which hold a min and an extent.
  template <std::same_as<std::shared_ptr<graph::ReductionDomainContents>> Domain>
  explicit RDom(const Domain& domain) : domain_(domain) {
    name_variables();
  }

  bool defined() const { return domain_ != nullptr; }  // whether the handle has a domain
  // Whether both handles refer to one domain.
  bool same_as(const RDom& other) const { return domain_ == other.domain_; }
  int dimensions() const;  // number of variables
  // Variable i; the innermost is 0.
  // Requires: variables are numbered from 0.
  RVar operator[](int i) const;
  // The variable of a one-dimensional domain.
  // Requires: only a domain of one variable converts to that variable.
  operator RVar() const;
  // The variable of a one-dimensional domain, as an Expr.
  operator Expr() const;
  // Keeps only the points where the predicate holds. Must precede the domain's first use in a definition.
  // Requires: the RDom was given a domain; the predicate must be a defined expression; a
  // predicate is of type bool; a predicate is given before the domain's first use in a definition.
  void where(Expr predicate);
  // The record behind the handle.
  const std::shared_ptr<graph::ReductionDomainContents>& domain() const { return domain_; }

  RVar x, y, z, w;  // the first four variables

 private:
  void initialize(const Region& region, const std::string& name);
  void name_variables();
  const RVar only_variable() const;
  void collect(const Region& region) { initialize(region, ""); }
  void collect(const Region& region, const std::string& name) { initialize(region, name); }
  template <typename... Args>
  void collect(Region& region, const Expr& min, const Expr& extent, Args&&... rest) {
    region.push_back({min, extent});
    collect(region, std::forward<Args>(rest)...);
  }
  std::shared_ptr<graph::ReductionDomainContents> domain_;
};

// Prints a variable's name, or the variables of a domain with their ranges.
std::ostream& operator<<(std::ostream& out, const RVar& var);
std::ostream& operator<<(std::ostream& out, const RDom& domain);

}  // namespace retrograde
