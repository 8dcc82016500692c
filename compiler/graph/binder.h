// binder.h -- gives the names in parsed expressions what they stand for.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "graph/function.h"
#include "ir/text.h"

namespace retrograde::graph {

using ParameterPtr = std::shared_ptr<ParameterContents>;

// The entities of a text.
struct NamedEntities {
  std::map<std::string, FuncPtr> funcs;
  std::map<std::string, ParameterPtr> parameters, outputs;  // outputs: the buffers of Funcs

  // The buffer of a fact such as "input.extent.1"; null when the name is none.
  ParameterPtr buffer_of_fact(const std::string& name) const;
};

// The types that the text of a graph leaves out in mentions of a Func, an image or a parameter.
void declare(const FuncContents& f, NameTypes& types);
void declare(const ParameterContents& parameter, NameTypes& types);

// Calls and variables of expressions in `f` (null: outside of Funcs) with their symbols: Funcs,
// images, parameters, facts of buffers, and the variables of `domain` (may be null).
class Binder {
 public:
  Binder(const NamedEntities& names, FuncPtr f, DomainPtr domain)
      : names_(names), f_(std::move(f)), domain_(std::move(domain)) {}

  // UserError when a Func or an image is not there (graph.h).
  Expr operator()(const Expr& e) const;
  // The expressions of a directive, and what it prefetches.
  void operator()(Directive& directive) const;

 private:
  Expr bound(const Call& call, const Expr& e) const;
  bool owns_me(const FuncContents& callee) const;
  SymbolRef symbol_of(const std::string& name) const;

  const NamedEntities& names_;
  FuncPtr f_;
  DomainPtr domain_;
};

}  // namespace retrograde::graph
