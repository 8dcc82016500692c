// var_or_rvar.h -- the name of a loop in a schedule: a pure variable or a reduction variable.
#pragma once

#include <string>

#include "frontend/language/rdom.h"
#include "frontend/language/var.h"

namespace retrograde {

struct VarOrRVar {
  VarOrRVar(const Var& v) : var(v), is_rvar(false) {}
  VarOrRVar(const RVar& r) : rvar(r), is_rvar(true) {}
  VarOrRVar(const RDom& r) : rvar(RVar(r)), is_rvar(true) {}
  template <int N>
  VarOrRVar(const ImplicitVar<N>& v) : var(v.to_var()), is_rvar(false) {}
  // Names of reduction variables have dots ("r.x"), those of Vars have none.
  VarOrRVar(const std::string& name, bool is_rvar)
      : var(is_rvar ? "_" : name), rvar(is_rvar ? name : "_"), is_rvar(is_rvar) {}
  const std::string& name() const { return is_rvar ? rvar.name() : var.name(); }

  Var var = Var("_");
  RVar rvar{"_"};
  bool is_rvar;
};

}  // namespace retrograde
