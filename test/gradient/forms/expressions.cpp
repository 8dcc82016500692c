// Sub-expressions are drawn from a pool of all those made so far, so that forms share nodes, or an equal one is built
// anew, so that they share structure.
#include "gradient/forms/expressions.h"

#include <string>
#include <vector>

#include "frontend/language/func.h"
#include "ir/build.h"

namespace retrograde::gradient {

namespace {

class FormMaker {
 public:
  FormMaker(Choices& choices, Type type) : c_(choices), type_(type) {
    for (const char* name : {"x", "y", "z"}) pool_.push_back(ir::variable(name, type));
  }

  Expr run() {
    for (int n = c_.between(1, 7); n > 0; --n) keep(form());
    return pool_.back();
  }

 private:
  Expr num(double value) { return ir::make_const(type_, value); }
  Expr one() { return ir::make_one(type_); }
  Expr keep(const Expr& e) {
    pool_.push_back(e);
    return e;
  }
  // Later entries are likelier, so that expressions grow.
  Expr any() {
    const int n = static_cast<int>(pool_.size());
    if (c_.chance(55)) return pool_[static_cast<size_t>(c_.below(3))];
    return pool_[static_cast<size_t>(n - 1 - c_.below(std::min(n, 4)))];
  }
  double constant() { return (1 + c_.below(19)) * 0.0987654321; }
  // A simple operand for a form.
  Expr simple() {
    switch (c_.below(8)) {
      case 1:
        return any() * any();
      case 2:
        return any() + any();
      case 3:
        return any() - any();
      case 4:
        return any() * num(constant());
      case 5:
        return -any();
      case 6:
        return any() + num(constant());
      default:
        return any();
    }
  }
  // An expression that is not negative, or above 0.
  Expr size() { return keep(c_.chance(50) ? abs(any()) : abs(simple())); }
  Expr positive() { return keep(size() + num(constant())); }
  // Moderate values: their exp neither overflows nor is denormal in float32.
  Expr exponent() {
    switch (c_.below(4)) {
      case 1:
        return -pool_[static_cast<size_t>(c_.below(3))];
      case 2:
        return tanh(any());
      case 3:
        return keep(any() / positive());
      default:
        return pool_[static_cast<size_t>(c_.below(3))];
    }
  }
  Expr power() { return keep(exp(exponent())); }

  Expr form() {
    return c_.one_of<Expr>({
        [&] { return simple(); },
        [&] { return logistic(); },
        [&] { return share(); },
        [&] { return softmax(); },
        [&] { return ratio(); },
        [&] { return ratio(); },
        [&] { return log_sum(); },
        [&] { return smooth_maximum(); },
        [&] { return smooth_maximum(); },
        [&] { return entropy(); },
        [&] { return angle(); },
        [&] { return norm(); },
        [&] { return norm(); },
        [&] { return quotient(); },
        [&] { return arithmetic(); },
        [&] { return choice(); },
    });
  }

  Expr logistic() {
    const Expr e = power(), s = c_.chance(50) ? one() : any();
    return c_.one_of<Expr>({
        [&] { return s / (one() + e); },
        [&] { return s / (e + one()); },
        [&] { return s / (one() + one() + e); },
        [&] { return s / (one() + e * e); },
        [&] { return s / (one() + e + size()); },
    });
  }

  Expr share() {
    const Expr a = c_.chance(30) ? power() : any(), b = positive();
    return c_.one_of<Expr>({
        [&] { return a / (one() + abs(a)); },
        [&] { return b / (b + size()); },
        [&] { return a / (b + abs(a)); },
        [&] { return b / (b + b + size()); },
        // Near misses: another magnitude, the other sign, a multiple.
        [&] { return a / (b + abs(any())); },
        [&] { return a / (abs(-a) + b); },
        [&] { return b / (num(2) * b + size()); },
        [&] { return size() / (size() + b); },
    });
  }

  Expr softmax() {
    const Expr a = power(), b = power(), c = power();
    return c_.one_of<Expr>({
        [&] { return a / (a + b); },
        [&] { return b / (a + b + c); },
        [&] { return a / (b + a + one()); },
        [&] { return a / (b + c); },
        [&] { return (a + b) / (a + b + c); },
        [&] { return a / (a + positive()); },
        // Nested forms.
        [&] { return a / (b + keep(a / (a + c))); },
    });
  }

  // A ratio of sums of the same terms, with either sign.
  Expr ratio() {
    std::vector<Expr> terms;
    for (int n = c_.between(2, 3); n > 0; --n)
      terms.push_back(c_.chance(25) ? num(constant()) : c_.chance(30) ? power() : positive());
    const auto sum = [&](bool is_positive) {
      Expr result;
      for (const Expr& t : terms) {
        if (c_.chance(15)) continue;
        if (!result.defined()) {
          result = t;
        } else {
          result = !is_positive && c_.chance(60) ? result - t : result + t;
        }
      }
      return result.defined() ? result : terms[0];
    };
    const Expr above = sum(c_.chance(20)), below = sum(c_.chance(70));
    return above / below;
  }

  Expr log_sum() {
    const Expr a = power(), b = power();
    return c_.one_of<Expr>({
        [&] { return log(one() + a); },
        [&] { return log(a + b); },
        [&] { return log(a + b + num(constant())); },
        [&] { return log(a + positive()); },
        [&] { return log(a * b + one()); },
        [&] { return log(positive() / positive()); },
    });
  }

  // max(a, b) + log(1 + exp(-|a - b|)), and expressions that resemble it.
  Expr smooth_maximum() {
    const Expr a = any(), b = c_.chance(20) ? ir::make_zero(type_) : simple();
    const Expr c = c_.chance(70) ? a : any(), d = c_.chance(70) ? b : any();
    const Expr difference = c_.chance(50) ? c - d : c_.chance(80) ? d - c : c + d;
    const Expr decay = log(one() + exp(-abs(difference)));
    return c_.one_of<Expr>({
        [&] { return max(a, b) + decay; },
        [&] { return max(a, b) + decay; },
        [&] { return decay - min(a, b); },
        [&] { return decay + max(a, b) - any(); },
        [&] { return any() + max(b, a) + decay; },
        [&] { return min(a, b) + decay; },
        [&] { return max(a, b) - decay; },
        [&] { return keep(max(a, b)) + keep(decay) + max(any(), any()); },
    });
  }

  Expr entropy() {
    const Expr a = positive(), b = positive(), c = positive();
    return c_.one_of<Expr>({
        [&] { return a * log(a); },
        [&] { return a * log(a / b); },
        [&] { return -a * log(a); },
        [&] { return log(a / b) * (a * num(constant())); },
        [&] { return b * log(a / b); },
        [&] { return a * log(b); },
        [&] { return a / b * log(a / b); },
        [&] { return (a + b) * log(a / c); },
        [&] { return keep(log(a / b)) * keep(log(a / b)); },
    });
  }

  Expr angle() {
    const Expr a = any(), b = simple();
    return c_.one_of<Expr>({
        [&] { return atan(a / b); },
        [&] { return atan2(a, b); },
        [&] { return atan(a / (b + a)); },
        [&] { return atan(a * b); },
    });
  }

  Expr squares(const Expr& a, const Expr& b) {
    return c_.one_of<Expr>({
        [&] { return a * a + b * b; },
        [&] { return pow(a, num(2)) + b * b; },
        [&] { return a * a + b * b + num(constant()); },
        [&] { return a * a + b * b + keep(simple()) * pool_.back(); },
        [&] { return a * a + b * (b + num(constant())) + num(40); },
        [&] { return a * a + abs(b); },
        [&] { return a * a + a * a; },
    });
  }
  Expr norm() {
    const Expr a = any(), b = simple(), sum = squares(a, b), length = keep(sqrt(sum));
    const Expr top = c_.chance(50) ? a : c_.chance(50) ? b : any();
    return c_.one_of<Expr>({
        [&] { return length; },
        [&] { return top / length; },
        [&] { return top * (one() / length); },
        [&] { return one() / length; },
        [&] { return top / max(length, num(constant())); },
        [&] { return top * pow(sum, num(-0.5)); },
        [&] { return top / hypot(a, b); },
        [&] { return max(top, one() / length); },
        [&] { return keep(a / length) * keep(b / length); },
        [&] { return top / max(num(constant()), length); },
    });
  }

  Expr quotient() {
    const Expr a = any(), b = c_.chance(70) ? a : simple();
    const Expr grown = exp(c_.chance(50) ? tanh(b) : b) - one();
    switch (c_.below(9)) {
      case 0:
        return sin(b) / a;
      case 1:
        return grown / a;
      case 2:
        return a / grown;
      case 3:
        return (one() - exp(-b)) / a;
      case 4: {
        const Expr p = size();
        return log(one() + p) / (c_.chance(70) ? p : size());
      }
      case 5: {
        const Expr p = size();
        return (c_.chance(70) ? p : size()) / log(one() + p);
      }
      case 6: {
        const Expr p = keep(any() / positive() * num(0.9));
        return log(one() - p) / p;
      }
      case 7:
        return sin(b) / (a + b);
      default:
        return (exp(b) - exp(-a)) / (exp(b) + exp(-b));
    }
  }

  Expr arithmetic() {
    const Expr a = any(), b = any();
    return c_.one_of<Expr>({
        [&] { return a * b; },
        [&] { return a + b; },
        [&] { return a - b; },
        [&] { return a / positive(); },
        [&] { return (a - b) / (a + b); },
        [&] { return one() / positive(); },
    });
  }
  Expr choice() {
    const Expr a = any(), b = any();
    return c_.one_of<Expr>({
        [&] { return max(a, b); },
        [&] { return select(a > b, simple(), simple()); },
        [&] { return abs(a) - b; },
        [&] { return min(a, simple()); },
    });
  }

  Choices& c_;
  Type type_;
  std::vector<Expr> pool_;
};

}  // namespace

Expr make_form(Choices& choices, Type type) { return FormMaker(choices, type).run(); }

}  // namespace retrograde::gradient
