// Sub-expressions are drawn from a pool that holds every one made so far, so that forms overlap on
// nodes; or an equal one is built anew, so that they overlap on equal nodes.
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
  // The last ones are the likelier, so that expressions grow.
  Expr any() {
    const int n = static_cast<int>(pool_.size());
    if (c_.chance(55)) return pool_[static_cast<size_t>(c_.below(3))];
    return pool_[static_cast<size_t>(n - 1 - c_.below(std::min(n, 4)))];
  }
  double constant() { return (1 + c_.below(19)) * 0.0987654321; }
  // Something to put into a form.
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
  // Not negative, or above 0.
  Expr size() { return keep(c_.chance(50) ? abs(any()) : abs(simple())); }
  Expr positive() { return keep(size() + num(constant())); }
  // Moderate: exp of it neither overflows nor is denormal in float32.
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
    switch (c_.below(16)) {
      case 0:
        return simple();
      case 1:
        return logistic();
      case 2:
        return share();
      case 3:
        return softmax();
      case 4:
      case 5:
        return ratio();
      case 6:
        return log_sum();
      case 7:
      case 8:
        return smooth_maximum();
      case 9:
        return entropy();
      case 10:
        return angle();
      case 11:
      case 12:
        return norm();
      case 13:
        return quotient();
      case 14:
        return arithmetic();
      default:
        return choice();
    }
  }

  Expr logistic() {
    const Expr e = power(), s = c_.chance(50) ? one() : any();
    switch (c_.below(5)) {
      case 0:
        return s / (one() + e);
      case 1:
        return s / (e + one());
      case 2:
        return s / (one() + one() + e);
      case 3:
        return s / (one() + e * e);
      default:
        return s / (one() + e + size());
    }
  }

  Expr share() {
    const Expr a = c_.chance(30) ? power() : any(), b = positive();
    switch (c_.below(8)) {
      case 0:
        return a / (one() + abs(a));
      case 1:
        return b / (b + size());
      case 2:
        return a / (b + abs(a));
      case 3:
        return b / (b + b + size());
      case 4:  // near: another magnitude, the other sign, a multiple
        return a / (b + abs(any()));
      case 5:
        return a / (abs(-a) + b);
      case 6:
        return b / (num(2) * b + size());
      default:
        return size() / (size() + b);
    }
  }

  Expr softmax() {
    const Expr a = power(), b = power(), c = power();
    switch (c_.below(7)) {
      case 0:
        return a / (a + b);
      case 1:
        return b / (a + b + c);
      case 2:
        return a / (b + a + one());
      case 3:
        return a / (b + c);
      case 4:
        return (a + b) / (a + b + c);
      case 5:
        return a / (a + positive());
      default:  // nested
        return a / (b + keep(a / (a + c)));
    }
  }

  // Sums of the same terms, with either sign.
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
    switch (c_.below(6)) {
      case 0:
        return log(one() + a);
      case 1:
        return log(a + b);
      case 2:
        return log(a + b + num(constant()));
      case 3:
        return log(a + positive());
      case 4:
        return log(a * b + one());
      default:
        return log(positive() / positive());
    }
  }

  // max(a, b) + log(1 + exp(-|a - b|)) and what looks like it.
  Expr smooth_maximum() {
    const Expr a = any(), b = c_.chance(20) ? ir::make_zero(type_) : simple();
    const Expr c = c_.chance(70) ? a : any(), d = c_.chance(70) ? b : any();
    const Expr difference = c_.chance(50) ? c - d : c_.chance(80) ? d - c : c + d;
    const Expr decay = log(one() + exp(-abs(difference)));
    switch (c_.below(8)) {
      case 0:
      case 1:
        return max(a, b) + decay;
      case 2:
        return decay - min(a, b);
      case 3:
        return decay + max(a, b) - any();
      case 4:
        return any() + max(b, a) + decay;
      case 5:
        return min(a, b) + decay;
      case 6:
        return max(a, b) - decay;
      default:
        return keep(max(a, b)) + keep(decay) + max(any(), any());
    }
  }

  Expr entropy() {
    const Expr a = positive(), b = positive(), c = positive();
    switch (c_.below(9)) {
      case 0:
        return a * log(a);
      case 1:
        return a * log(a / b);
      case 2:
        return -a * log(a);
      case 3:
        return log(a / b) * (a * num(constant()));
      case 4:
        return b * log(a / b);
      case 5:
        return a * log(b);
      case 6:
        return a / b * log(a / b);
      case 7:
        return (a + b) * log(a / c);
      default:
        return keep(log(a / b)) * keep(log(a / b));
    }
  }

  Expr angle() {
    const Expr a = any(), b = simple();
    switch (c_.below(4)) {
      case 0:
        return atan(a / b);
      case 1:
        return atan2(a, b);
      case 2:
        return atan(a / (b + a));
      default:
        return atan(a * b);
    }
  }

  Expr squares(const Expr& a, const Expr& b) {
    switch (c_.below(7)) {
      case 0:
        return a * a + b * b;
      case 1:
        return pow(a, num(2)) + b * b;
      case 2:
        return a * a + b * b + num(constant());
      case 3:
        return a * a + b * b + keep(simple()) * pool_.back();
      case 4:
        return a * a + b * (b + num(constant())) + num(40);
      case 5:
        return a * a + abs(b);
      default:
        return a * a + a * a;
    }
  }
  Expr norm() {
    const Expr a = any(), b = simple(), sum = squares(a, b), length = keep(sqrt(sum));
    const Expr top = c_.chance(50) ? a : c_.chance(50) ? b : any();
    switch (c_.below(10)) {
      case 0:
        return length;
      case 1:
        return top / length;
      case 2:
        return top * (one() / length);
      case 3:
        return one() / length;
      case 4:
        return top / max(length, num(constant()));
      case 5:
        return top * pow(sum, num(-0.5));
      case 6:
        return top / hypot(a, b);
      case 7:
        return max(top, one() / length);
      case 8:
        return keep(a / length) * keep(b / length);
      default:
        return top / max(num(constant()), length);
    }
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
    switch (c_.below(6)) {
      case 0:
        return a * b;
      case 1:
        return a + b;
      case 2:
        return a - b;
      case 3:
        return a / positive();
      case 4:
        return (a - b) / (a + b);
      default:
        return one() / positive();
    }
  }
  Expr choice() {
    const Expr a = any(), b = any();
    switch (c_.below(4)) {
      case 0:
        return max(a, b);
      case 1:
        return select(a > b, simple(), simple());
      case 2:
        return abs(a) - b;
      default:
        return min(a, simple());
    }
  }

  Choices& c_;
  Type type_;
  std::vector<Expr> pool_;
};

}  // namespace

Expr make_form(Choices& choices, Type type) { return FormMaker(choices, type).run(); }

}  // namespace retrograde::gradient
