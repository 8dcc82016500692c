// generator_param.h -- GeneratorParam<T>, a compile-time parameter of a generator.
//
// GeneratorParam<int> levels{"levels", 4, 1, 8};   // a build file passes levels=6
// GeneratorParam<Edge> edge{"edge", Edge::Clamp, {{"clamp", Edge::Clamp}, {"mirror",
// Edge::Mirror}}};
//
// T is bool, an arithmetic or enumeration type, std::string, Type, Target, LoopLevel or MachineParams. A text that is
// not a value of T to its last character, or a value out of range, throws CompileError with the allowed values.
#pragma once

#include <charconv>
#include <map>
#include <optional>
#include <string>
#include <type_traits>

#include "frontend/language/func.h"
#include "frontend/schedule/autoschedule_options.h"
#include "frontend/schedule/autoscheduler.h"
#include "ir/print.h"

namespace retrograde {
namespace internal {

// The part of GeneratorParam<T> that does not depend on T.
class GeneratorParamBase {
 public:
  // A parameter of this name; it registers with the generator around it.
  explicit GeneratorParamBase(const std::string& name);
  virtual ~GeneratorParamBase() = default;
  GeneratorParamBase(const GeneratorParamBase&) = delete;
  GeneratorParamBase& operator=(const GeneratorParamBase&) = delete;

  const std::string& name() const { return name_; }  // name of the parameter
  // Sets the value from text.
  virtual void set_from_string(const std::string& text) = 0;
  // Sets the value of a LoopLevel parameter.
  // Requires: a param takes values of its type.
  virtual void set_from_loop_level(const LoopLevel& level);
  // The value as text that set_from_string() accepts.
  virtual std::string to_string() const = 0;
  // The declaration of the parameter in a stub; see cpp_stub.h.
  struct InCpp {
    std::string type, value;           // "int", "3"
    std::vector<std::string> choices;  // enumerators of an enumeration, whose type has no name
    const char* to_text = "";  // function that converts a value to text; "": the value is text
  };
  virtual InCpp in_cpp() const = 0;

 protected:
  bool is_writable() const;  // whether generate() has not run
  // Throws CompileError once generate() has run, since it has read the value.
  void check_writable() const;
  [[noreturn]] void refuse(const std::string& value, const std::string& rule,
                           const std::string& evidence, const std::string& instead) const;

 private:
  std::string name_;
};

// ---- values as text; nullopt if the text is not a value ----

template <typename T>
std::optional<T> read_number(const std::string& text) {
  T value{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}
std::optional<bool> read_bool(const std::string& text);
std::optional<Type> read_type(const std::string& text);
std::optional<LoopLevel> read_loop_level(const std::string& text);
std::string type_choices();  // "bool, int8, ..."

std::string cpp_literal(const std::string& text);  // "\"a\\n\""
std::string cpp_type(const Type& type);            // "::retrograde::Int(32)"
std::string cpp_element_name(const Type& type);    // "int32_t"

template <typename T>
std::string number_text(T value) {
  char text[64];
  return std::string(text, std::to_chars(text, text + sizeof text, value).ptr);
}

// A value as text that set_from_string() accepts.
inline std::string param_text(bool value) { return value ? "true" : "false"; }
template <typename T>
std::string param_text(T value) {
  return number_text(value);
}

// Whether a conversion to To keeps the value; floats may round, integers may not.
template <typename To, typename From>
bool keeps_value(From from) {
  if constexpr (std::is_floating_point_v<From> && std::is_floating_point_v<To>) {
    return true;
  } else if constexpr (std::is_floating_point_v<From>) {
    const double low = static_cast<double>(std::numeric_limits<To>::min());
    const double high = static_cast<double>(std::numeric_limits<To>::max() / 2 + 1) * 2.0;
    return from >= low && from < high && from == static_cast<From>(static_cast<To>(from));
  } else {
    const To to = static_cast<To>(from);
    return static_cast<From>(to) == from && ((to < To(0)) == (from < From(0)));
  }
}

}  // namespace internal

// A compile-time parameter of a generator with a default value.
template <typename T>
class GeneratorParam : public internal::GeneratorParamBase {
  static constexpr bool is_number = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;
  static constexpr bool is_text = std::is_same_v<T, std::string>;

 public:
  // A parameter with a default.
  GeneratorParam(const std::string& name, const T& value)
      : GeneratorParamBase(name), value_(value) {}
  // A number in [min, max].
  GeneratorParam(const std::string& name, const T& value, const T& min,
                 const T& max) requires is_number : GeneratorParamBase(name),
                                                    min_(min),
                                                    max_(max) {
    assign(value);
  }
  GeneratorParam(const std::string& name, const T& value,
                 // An enumeration with the names of its values.
                 const std::map<std::string, T>& choices) requires std::is_enum_v<T>
      : GeneratorParamBase(name), value_(value), choices_(choices) {
    to_string();  // the default is one of the choices
  }

  T value() const { return value_; }     // the value
  operator T() const { return value_; }  // the value
  // The value as a constant Expr.
  operator Expr() const requires std::is_arithmetic_v<T> { return Expr(value_); }

  // Sets a LoopLevel. After generate() too: schedules that use the level then follow it.
  void set(const LoopLevel& level) requires std::is_same_v<T, LoopLevel> {
    if (is_writable())
      value_ = level;
    else
      value_.set(level);
  }
  // Sets the value; must precede generate().
  template <typename V>
  void set(const V& value) {
    if constexpr (!std::is_same_v<T, LoopLevel>) check_writable();
    if constexpr (std::is_convertible_v<V, std::string> && !is_text) {
      set_from_string(value);
    } else if constexpr (is_number && std::is_arithmetic_v<V>) {
      if (!internal::keeps_value<T>(value)) refuse_value(text(value), "it does not fit the type");
      assign(static_cast<T>(value));
    } else {
      value_ = value;
    }
  }
  // Sets the value from text.
  void set_from_string(const std::string& text) override;
  // Sets the value of a LoopLevel parameter.
  void set_from_loop_level(const LoopLevel& level) override {
    if constexpr (std::is_same_v<T, LoopLevel>)
      set(level);
    else
      GeneratorParamBase::set_from_loop_level(level);
  }
  // The value as text that set_from_string() accepts.
  std::string to_string() const override;
  InCpp in_cpp() const override;

 private:
  T value_;
  T min_ = {}, max_ = {};  // of numbers; no limits when both are zero
  std::map<std::string, T> choices_;

  bool has_limits() const {
    if constexpr (is_number) return min_ != T{} || max_ != T{};
    return false;
  }
  void assign(const T& value) {
    if constexpr (is_number) {
      if (has_limits() && !(value >= min_ && value <= max_))
        refuse_value(internal::number_text(value), "it is out of range");
    }
    value_ = value;
  }
  std::string allowed() const;
  [[noreturn]] void refuse_value(const std::string& value, const std::string& evidence) const {
    refuse(value, "its values are " + allowed(), evidence, "Give one of these values");
  }
};

// The overloads for MachineParams, Target and AutoscheduleOptions report what is wrong with the text themselves.
template <typename T>
void GeneratorParam<T>::set_from_string(const std::string& text) {
  check_writable();
  std::optional<T> value;
  if constexpr (is_text) {
    value = text;
  } else if constexpr (std::is_same_v<T, bool>) {
    value = internal::read_bool(text);
  } else if constexpr (std::is_enum_v<T>) {
    if (auto found = choices_.find(text); found != choices_.end()) value = found->second;
  } else if constexpr (std::is_same_v<T, Type>) {
    value = internal::read_type(text);
  } else if constexpr (std::is_same_v<T, LoopLevel>) {
    value = internal::read_loop_level(text);
  } else if constexpr (std::is_same_v<T, Target> || std::is_same_v<T, MachineParams>) {
    value = T(text);
  } else if constexpr (std::is_same_v<T, AutoscheduleOptions>) {
    value = T::from_string(text);
  } else {
    static_assert(is_number, "a GeneratorParam cannot be of this type");
    value = internal::read_number<T>(text);
  }
  if (!value) refuse_value(text, "this is not one of them");
  assign(*value);
}

// The value as text that set_from_string() accepts.
template <typename T>
std::string GeneratorParam<T>::to_string() const {
  if constexpr (is_text) {
    return value_;
  } else if constexpr (std::is_enum_v<T>) {
    for (const auto& [text, value] : choices_) {
      if (value == value_) return text;
    }
    refuse_value("its default value", "the map of its names does not hold it");
  } else if constexpr (std::is_same_v<T, Type>) {
    return retrograde::to_string(value_);
  } else if constexpr (std::is_arithmetic_v<T>) {
    return internal::param_text(value_);
  } else {
    return value_.to_string();
  }
}

template <typename T>
internal::GeneratorParamBase::InCpp GeneratorParam<T>::in_cpp() const {
  if constexpr (is_text) {
    return {"std::string", internal::cpp_literal(value_), {}};
  } else if constexpr (std::is_enum_v<T>) {
    return {"", to_string(),
            ir::mapped(choices_, [&](const auto& choice) { return choice.first; })};
  } else if constexpr (std::is_same_v<T, Type>) {
    return {"::retrograde::Type", internal::cpp_type(value_), {}, "::retrograde::to_string"};
  } else if constexpr (std::is_same_v<T, LoopLevel>) {
    return {"::retrograde::LoopLevel", "::retrograde::LoopLevel::" + to_string() + "()", {}};
  } else if constexpr (std::is_same_v<T, bool>) {
    return {"bool", to_string(), {}, "::retrograde::internal::param_text"};
  } else if constexpr (is_number) {
    return {internal::cpp_element_name(type_of<T>()),
            to_string(),
            {},
            "::retrograde::internal::param_text"};
  } else {
    return {};  // parameters of every generator, such as target, whose values the context provides
  }
}

template <typename T>
std::string GeneratorParam<T>::allowed() const {
  if constexpr (std::is_same_v<T, bool>) {
    return "\"true\" and \"false\"";
  } else if constexpr (std::is_enum_v<T>) {
    return listed(choices_, [](const auto& choice) { return retrograde::quoted(choice.first); });
  } else if constexpr (std::is_same_v<T, Type>) {
    return internal::type_choices();
  } else if constexpr (std::is_same_v<T, LoopLevel>) {
    return "\"root\" and \"inlined\"";
  } else if constexpr (is_number) {
    std::string kind = std::is_floating_point_v<T> ? "numbers" : "whole numbers";
    if (has_limits()) {
      return kind + " from " + internal::number_text(min_) + " to " + internal::number_text(max_);
    }
    return kind + " of type " + retrograde::to_string(type_of<T>());
  } else {
    return "those of its type";
  }
}

// ---- operators use the value of a parameter: levels - 1, gain * in(x), a && b ----

#define RETROGRADE_PARAM_OPERATOR(op)                                                  \
  template <typename T, typename U>                                                    \
  auto operator op(const GeneratorParam<T>& a, const U& b)->decltype(a.value() op b) { \
    return a.value() op b;                                                             \
  }                                                                                    \
  template <typename T, typename U>                                                    \
  auto operator op(const U& a, const GeneratorParam<T>& b)->decltype(a op b.value()) { \
    return a op b.value();                                                             \
  }                                                                                    \
  template <typename T, typename U>                                                    \
  auto operator op(const GeneratorParam<T>& a, const GeneratorParam<U>& b)             \
      ->decltype(a.value() op b.value()) {                                             \
    return a.value() op b.value();                                                     \
  }
RETROGRADE_PARAM_OPERATOR(+)
RETROGRADE_PARAM_OPERATOR(-)
RETROGRADE_PARAM_OPERATOR(*)
RETROGRADE_PARAM_OPERATOR(/)
RETROGRADE_PARAM_OPERATOR(%)
RETROGRADE_PARAM_OPERATOR(<)
RETROGRADE_PARAM_OPERATOR(<=)
RETROGRADE_PARAM_OPERATOR(>)
RETROGRADE_PARAM_OPERATOR(>=)
RETROGRADE_PARAM_OPERATOR(==)
RETROGRADE_PARAM_OPERATOR(!=)
RETROGRADE_PARAM_OPERATOR(&&)
RETROGRADE_PARAM_OPERATOR(||)
#undef RETROGRADE_PARAM_OPERATOR
// The negated value.
template <typename T>
auto operator-(const GeneratorParam<T>& a) -> decltype(-a.value()) {
  return -a.value();
}
// Prints the value as text.
template <typename T>
std::ostream& operator<<(std::ostream& out, const GeneratorParam<T>& a) {
  return out << a.to_string();
}
// The logical negation of the value.
template <typename T>
auto operator!(const GeneratorParam<T>& a) -> decltype(!a.value()) {
  return !a.value();
}

#define RETROGRADE_PARAM_EXTREME(name)                                  \
  namespace internal {                                                  \
  template <typename A, typename B>                                     \
  auto name##_of(const A& a, const B& b) {                              \
    if constexpr (std::is_arithmetic_v<A> && std::is_arithmetic_v<B>) { \
      return std::name<std::common_type_t<A, B>>(a, b);                 \
    } else {                                                            \
      return retrograde::name(Expr(a), Expr(b));                        \
    }                                                                   \
  }                                                                     \
  }                                                                     \
  template <typename T, typename U>                                     \
  auto name(const GeneratorParam<T>& a, const U& b) {                   \
    return internal::name##_of(a.value(), b);                           \
  }                                                                     \
  template <typename T, typename U>                                     \
  auto name(const GeneratorParam<T>& a, const GeneratorParam<U>& b) {   \
    return internal::name##_of(a.value(), b.value());                   \
  }                                                                     \
  template <typename T, typename U>                                     \
  auto name(const U& a, const GeneratorParam<T>& b) {                   \
    return internal::name##_of(a, b.value());                           \
  }
RETROGRADE_PARAM_EXTREME(min)  // std::min for numbers, an Expr otherwise
RETROGRADE_PARAM_EXTREME(max)  // std::max for numbers, an Expr otherwise
#undef RETROGRADE_PARAM_EXTREME

}  // namespace retrograde
