// Converts isl's affine functions and sets back to expressions.
#include <isl/constraint.h>

#include "autodiff/inversion/isl_bridge.h"
#include "ir/build.h"

namespace retrograde::autodiff {

namespace {

int64_t to_int(__isl_take isl_val* v) {
  int64_t result = isl_val_get_num_si(v);
  isl_val_free(v);
  return result;
}

// The callback through which isl's C functions call a lambda for each part.
template <class Visit, class... Parts>
isl_stat visit_each(Parts*... parts, void* visit) {
  (*static_cast<Visit*>(visit))(parts...);
  return isl_stat_ok;
}

// Builds sums with positive terms first, so that differences print as differences.
class SumBuilder {
 public:
  void add(const Expr& term, int64_t coefficient) {
    if (coefficient == 0) return;
    Expr scaled =
        std::abs(coefficient) == 1 ? term : term * make_const(Int(32), std::abs(coefficient));
    Expr& side = coefficient > 0 ? plus_ : minus_;
    add_term(side, scaled);
  }
  Expr finish(int64_t constant) {
    if (!plus_.defined()) {
      if (!minus_.defined()) return make_const(Int(32), constant);
      return make_const(Int(32), constant) - minus_;
    }
    Expr result = minus_.defined() ? plus_ - minus_ : plus_;
    if (constant == 0) return result;
    return constant > 0 ? result + make_const(Int(32), constant)
                        : result - make_const(Int(32), -constant);
  }

 private:
  Expr plus_, minus_;
};

}  // namespace

class IslToExpr {
 public:
  IslToExpr(const IslBridge& bridge, const std::vector<Expr>& names)
      : bridge_(bridge), names_(names) {}

  Expr aff(__isl_keep isl_aff* a) const {
    int64_t denominator = to_int(isl_aff_get_denominator_val(a));
    isl_aff* scaled =
        isl_aff_scale_val(isl_aff_copy(a), isl_val_int_from_si(bridge_.ctx_, denominator));
    Expr result = integral(scaled);
    isl_aff_free(scaled);
    return denominator == 1 ? result : result / make_const(Int(32), denominator);
  }

  Expr pieces(__isl_keep isl_pw_aff* e) const {
    struct Piece {
      Expr condition, value;
    };
    std::vector<Piece> list;
    auto collect = [&](isl_set* s, isl_aff* a) {
      list.push_back({set(s), aff(a)});
      isl_set_free(s);
      isl_aff_free(a);
    };
    isl_pw_aff_foreach_piece(e, visit_each<decltype(collect), isl_set, isl_aff>, &collect);
    if (list.empty()) return make_zero(Int(32));
    Expr result = list.back().value;
    for (size_t i = list.size() - 1; i-- > 0;)
      result = make_select(list[i].condition, list[i].value, result);
    return result;
  }

  Expr set(__isl_keep isl_set* s) const {
    isl_set* explicit_divs = isl_set_compute_divs(isl_set_coalesce(isl_set_copy(s)));
    Expr result;
    auto collect = [&](isl_basic_set* b) {
      Expr term = basic_set(b);
      result = result.defined() ? result || term : term;
      isl_basic_set_free(b);
    };
    isl_set_foreach_basic_set(explicit_divs, visit_each<decltype(collect), isl_basic_set>,
                              &collect);
    isl_set_free(explicit_divs);
    return result.defined() ? result : const_false();
  }

 private:
  // The sum with denominator 1: dims, parameters and floors of divisions.
  Expr integral(__isl_keep isl_aff* a) const {
    SumBuilder sum;
    for (isl_dim_type type : {isl_dim_in, isl_dim_param}) {
      int n = isl_aff_dim(a, type);
      for (int i = 0; i < n; ++i) {
        int64_t c = to_int(isl_aff_get_coefficient_val(a, type, i));
        if (c != 0) sum.add(name(a, type, i), c);
      }
    }
    int n = isl_aff_dim(a, isl_dim_div);
    for (int i = 0; i < n; ++i) {
      int64_t c = to_int(isl_aff_get_coefficient_val(a, isl_dim_div, i));
      if (c == 0) continue;
      isl_aff* div = isl_aff_get_div(a, i);
      sum.add(aff(div), c);
      isl_aff_free(div);
    }
    return sum.finish(to_int(isl_aff_get_constant_val(a)));
  }

  Expr name(__isl_keep isl_aff* a, isl_dim_type type, int i) const {
    if (type == isl_dim_in) return names_.at(static_cast<size_t>(i));
    return cast_to(Int(32), bridge_.parameters_.at(
                                isl_aff_get_dim_name(a, isl_dim_param, static_cast<unsigned>(i))));
  }

  Expr basic_set(__isl_keep isl_basic_set* b) const {
    std::vector<Expr> terms;
    auto collect = [&](isl_constraint* c) {
      isl_aff* a = isl_constraint_get_aff(c);
      // Constraints that only define a div add no information.
      if (!isl_constraint_is_div_constraint(c)) {
        terms.push_back(isl_constraint_is_equality(c) ? equality(a) : inequality(a));
      }
      isl_aff_free(a);
      isl_constraint_free(c);
    };
    isl_basic_set_foreach_constraint(b, visit_each<decltype(collect), isl_constraint>, &collect);
    return conjunction(terms);
  }

  // a == 0, written with each term on the side where it is positive.
  Expr equality(__isl_keep isl_aff* a) const { return balance(a, Kind::EQ); }
  Expr inequality(__isl_keep isl_aff* a) const { return balance(a, Kind::GE); }
  Expr balance(__isl_keep isl_aff* a, Kind kind) const {
    isl_aff *positive = isl_aff_copy(a), *negative = isl_aff_neg(isl_aff_copy(a));
    for (isl_aff** side : {&positive, &negative}) *side = without_negative_terms(*side);
    Expr result = ir::binary(kind, aff(positive), aff(negative));
    isl_aff_free(positive);
    isl_aff_free(negative);
    return result;
  }
  static isl_aff* without_negative_terms(__isl_take isl_aff* a) {
    for (isl_dim_type type : {isl_dim_in, isl_dim_param, isl_dim_div}) {
      for (int i = 0, n = isl_aff_dim(a, type); i < n; ++i) {
        isl_val* v = isl_aff_get_coefficient_val(a, type, i);
        if (isl_val_is_neg(v)) a = isl_aff_set_coefficient_si(a, type, i, 0);
        isl_val_free(v);
      }
    }
    isl_val* v = isl_aff_get_constant_val(a);
    if (isl_val_is_neg(v)) a = isl_aff_set_constant_si(a, 0);
    isl_val_free(v);
    return a;
  }

  const IslBridge& bridge_;
  const std::vector<Expr>& names_;
};

Expr IslBridge::to_expr(const isl::pw_aff& e, const std::vector<Expr>& names) const {
  Expr result = IslToExpr(*this, names).pieces(e.get());
  throw_if_failed(ctx_);
  return result;
}
Expr IslBridge::to_expr(const isl::set& s, const std::vector<Expr>& names) const {
  Expr result = IslToExpr(*this, names).set(s.get());
  throw_if_failed(ctx_);
  return result;
}

}  // namespace retrograde::autodiff
