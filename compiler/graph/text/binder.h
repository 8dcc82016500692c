// binder.h -- binds the names in parsed expressions to Funcs, images and parameters.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "graph/function.h"
#include "ir/text.h"

namespace retrograde::graph {

using ParameterPtr = std::shared_ptr<ParameterContents>;

// The named entities of a text.
struct NamedEntities {
  std::map<std::string, FuncPtr> funcs;
  std::map<std::string, ParameterPtr> parameters, outputs;  // outputs: the output buffers of Funcs

  // The buffer behind a metadata variable such as "input.extent.1"; null for other names.
  ParameterPtr buffer_of_metadata(const std::string& name) const;
};

// Declares the types that graph text omits where it mentions a Func, an image or a parameter.
void declare(const FuncContents& f, NameTypes& types);
void declare(const ParameterContents& parameter, NameTypes& types);

// Parses an expression in which these names may be read. If it cannot be parsed, a Func or an image that does not exist
// is blamed first: its type was a guess.
Expr parse_with_names(const std::string& text, const NameTypes& types, const NamedEntities& names);

// Attaches symbols to the calls and variables in expressions of `f` (null: outside of Funcs):
// Funcs, images, parameters, buffer metadata, and the variables of `domain` (may be null).
class Binder {
 public:
  Binder(const NamedEntities& names, FuncPtr f, DomainPtr domain)
      : names_(names), f_(std::move(f)), domain_(std::move(domain)) {}

  // UserError when a Func or an image does not exist (graph.h).
  Expr operator()(const Expr& e) const;
  // Binds the expressions of a directive, and the Func or image that it prefetches.
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
