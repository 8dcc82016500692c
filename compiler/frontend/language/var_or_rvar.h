// var_or_rvar.h -- the name of a loop in a schedule: a pure variable or a reduction variable.
#pragma once

#include <string>

#include "frontend/language/rdom.h"
#include "frontend/language/var.h"

namespace retrograde {

// The name of a loop in a schedule: a pure variable or a reduction variable.
struct VarOrRVar {
  // Converts a Var, RVar or one-dimensional RDom.
  VarOrRVar(const Var& v) : var(v), is_rvar(false) {}
  VarOrRVar(const RVar& r) : rvar(r), is_rvar(true) {}
  VarOrRVar(const RDom& r) : rvar(RVar(r)), is_rvar(true) {}
  template <int N>
  VarOrRVar(const ImplicitVar<N>& v) : var(v.to_var()), is_rvar(false) {}
  // A variable by name. Names of RDom variables contain a dot ("r.x"), names of Vars do not.
  VarOrRVar(const std::string& name, bool is_rvar)
      : var(is_rvar ? "_" : name), rvar(is_rvar ? name : "_"), is_rvar(is_rvar) {}
  // The name of the loop.
  const std::string& name() const { return is_rvar ? rvar.name() : var.name(); }

  Var var = Var("_");  // the Var, if it is one
  RVar rvar{"_"};      // the RVar, if it is one
  bool is_rvar;        // whether it is a reduction variable
};

}  // namespace retrograde
