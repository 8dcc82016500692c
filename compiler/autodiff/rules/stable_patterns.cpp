#include "autodiff/rules/stable_patterns.h"

#include "ir/build.h"
#include "ir/equal.h"

namespace retrograde::autodiff {

namespace {
constexpr size_t most_terms = 4;
}

Expr without_sign(const Expr& e) {
  const auto* difference = e.as<Sub>();
  return difference && is_zero(difference->a) ? difference->b : e;
}

double sign_between(const Expr& w, const Expr& x) {
  const Expr size = without_sign(w);
  return equal(w, x) ? 1 : equal(size, without_sign(x)) ? -1 : 0;
}

std::vector<SignedTerm> signed_terms_of(const Expr& sum) {
  std::vector<SignedTerm> terms, todo{{sum, 1}};
  while (!todo.empty()) {
    SignedTerm e = todo.back();
    todo.pop_back();
    const auto* add = e.value.as<Add>();
    const auto* sub = e.value.as<Sub>();
    if (add) {
      todo.push_back({add->b, e.sign});
      todo.push_back({add->a, e.sign});
    } else if (sub) {
      todo.push_back({sub->b, -e.sign});
      todo.push_back({sub->a, e.sign});
    } else if (!is_zero(e.value)) {
      terms.push_back(e);
    }
    if (terms.size() + todo.size() > most_terms) return {};
  }
  return terms;
}

std::vector<Expr> terms_of(const Expr& sum) {
  std::vector<Expr> terms, todo{sum};
  while (!todo.empty()) {
    Expr e = todo.back();
    todo.pop_back();
    if (const auto* add = e.as<Add>()) {
      todo.insert(todo.end(), {add->b, add->a});
    } else {
      terms.push_back(e);
    }
    if (terms.size() + todo.size() > most_terms) return {};
  }
  return terms;
}

}  // namespace retrograde::autodiff
