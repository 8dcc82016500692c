// rdom.h -- reduction domains: the loops that belong to an update definition.
//
// RDom r(0, width, 0, height); r.where(r.x < r.y); f(x) += g(x + r.x, r.y);
// The first variable runs innermost. Points that fail a predicate are left out.
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

// One variable of a reduction domain. One made by name alone stands for a loop in a schedule, as in
// f.update().split(r.x, outer, inner, 8).
class RVar {
 public:
  RVar();  // a fresh name
  explicit RVar(const std::string& name);
  template <frontend::TextPointer T>
  explicit RVar(const T& name) : RVar(frontend::name_from(name, "an RVar")) {}
  explicit RVar(std::nullptr_t) = delete;
  RVar(std::shared_ptr<graph::ReductionDomainContents> domain, int index);

  const std::string& name() const { return name_; }
  // Requires: only a variable of an RDom has a range.
  Expr min() const;     // where its range begins
  Expr extent() const;  // how many values it takes
  operator Expr() const;
  const std::shared_ptr<graph::ReductionDomainContents>& domain() const { return domain_; }

 private:
  const graph::ReductionVariable& variable(const char* asked) const;
  std::string name_;
  std::shared_ptr<graph::ReductionDomainContents> domain_;
  int index_ = -1;
};

class RDom {
 public:
  RDom() = default;
  // Requires: a reduction domain has at least one variable; its min must be a defined expression;
  // its extent must be an integer; its bounds must be known before any loop starts; an extent is
  // not negative.
  RDom(const Region& region, const std::string& name = "");
  RDom(const Region& region, std::nullptr_t) = delete;
  RDom(std::initializer_list<Range> region) : RDom(Region(region)) {}
  // (min, extent) of each variable, and optionally a name: RDom r(0, 3, 0, 3, "r").
  template <typename... Args>
  RDom(Expr min, Expr extent, Args&&... rest) {
    Region region{{std::move(min), std::move(extent)}};
    collect(region, std::forward<Args>(rest)...);
  }
  template <typename T, int Dims>
  RDom(const Buffer<T, Dims>& buffer);  // all of its elements
  RDom(const OutputImageParam& image);
  // Not of braces, which hold a min and an extent.
  template <std::same_as<std::shared_ptr<graph::ReductionDomainContents>> Domain>
  explicit RDom(const Domain& domain) : domain_(domain) {
    name_variables();
  }

  bool defined() const { return domain_ != nullptr; }  // whether it was given a domain
  // One domain, two handles.
  bool same_as(const RDom& other) const { return domain_ == other.domain_; }
  int dimensions() const;  // how many variables it has
  // Requires: variables are numbered from 0.
  RVar operator[](int i) const;  // one of its variables, the innermost first
  // Requires: only a domain of one variable stands for that variable.
  operator RVar() const;  // of a domain of one variable
  operator Expr() const;
  // Keeps only the points where the predicate holds. Before the domain's first use in a definition.
  // Requires: the RDom was given a domain; the predicate must be a defined expression; a
  // predicate is of type bool; a predicate is given before the domain's first use in a definition.
  void where(Expr predicate);
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

std::ostream& operator<<(std::ostream& out, const RVar& var);
std::ostream& operator<<(std::ostream& out, const RDom& domain);

}  // namespace retrograde
