// inline_reductions.cpp -- binds reductions inside expressions: sum, product, maximum, ...
#include "frontend/language/inline_reductions.h"

#include "bind_all.h"
#include "binding.h"

namespace retrograde::python {

void bind_inline_reductions(py::module_& m) {
  using py::arg;
#define RETROGRADE_REDUCTION(name)                                                                \
  def(                                                                                            \
      m, #name,                                                                                   \
      [](const RDom& domain, const Expr& e, const Func& f) { return name(domain, e, f); },        \
      arg("domain"), arg("e"), arg("func"));                                                      \
  def(                                                                                            \
      m, #name,                                                                                   \
      [](const RDom& domain, const Expr& e, const std::string& n) { return name(domain, e, n); }, \
      arg("domain"), arg("e"), arg("name") = #name);                                              \
  def(                                                                                            \
      m, #name, [](const Expr& e, const Func& f) { return name(e, f); }, arg("e"), arg("func"));  \
  def(                                                                                            \
      m, #name, [](const Expr& e, const std::string& n) { return name(e, n); }, arg("e"),         \
      arg("name") = #name)
  RETROGRADE_REDUCTION(sum);
  RETROGRADE_REDUCTION(saturating_sum);
  RETROGRADE_REDUCTION(product);
  RETROGRADE_REDUCTION(maximum);
  RETROGRADE_REDUCTION(minimum);
  RETROGRADE_REDUCTION(argmax);
  RETROGRADE_REDUCTION(argmin);
#undef RETROGRADE_REDUCTION
}

}  // namespace retrograde::python
