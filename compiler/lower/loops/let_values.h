// let_values.h -- expressions without the names that lets bind, for analyses of a statement within others.
#pragma once

#include "ir/build.h"
#include "ir/lets.h"
#include "ir/markers.h"
#include "ir/visit.h"

namespace retrograde::lower {

class LetValues {
 public:
  // `around`: names bound around the statement, with expanded values.
  explicit LetValues(const Substitution& around) : around_(around) {}

  // Adds the lets of a statement. Those around others come first, so each value is expanded once.
  void add(const Stmt& s) {
    walk(s, [&](const LetStmt& let) {
      if (!values_.count(let.name)) values_[let.name] = expanded(let.value);
    });
  }

  Expr expanded(const Expr& e) const {
    return substitute(substitute(ir::without_lets(e), values_), around_);
  }
  // The same without hints.
  Expr operator()(const Expr& e) const { return ir::without_likely(expanded(e)); }

 private:
  const Substitution& around_;
  Substitution values_;
};

}  // namespace retrograde::lower
