// generator_param.h -- GeneratorParam<T>: a value that shapes the code a generator makes.
//
// GeneratorParam<int> levels{"levels", 4, 1, 8};   // a build file says levels=6
// GeneratorParam<Edge> edge{"edge", Edge::Clamp, {{"clamp", Edge::Clamp}, {"mirror",
// Edge::Mirror}}};
//
// T is bool, an arithmetic or enumeration type, std::string, Type, Target, LoopLevel or
// MachineParams. A value that does not parse to its last character, or that is out of range, is a
// CompileError that lists what is allowed.
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

class GeneratorParamBase {
 public:
  explicit GeneratorParamBase(const std::string& name);
  virtual ~GeneratorParamBase() = default;
  GeneratorParamBase(const GeneratorParamBase&) = delete;
  GeneratorParamBase& operator=(const GeneratorParamBase&) = delete;

  const std::string& name() const { return name_; }
  virtual void set_from_string(const std::string& text) = 0;
  // Requires: a param takes values of its type.
  virtual void set_from_loop_level(const LoopLevel& level);
  // What set_from_string reads back.
  virtual std::string to_string() const = 0;
  // How a stub declares it; see cpp_stub.h.
  struct InCpp {
    std::string type, value;           // "int", "3"
    std::vector<std::string> choices;  // of an enumeration; its type has no name
    const char* to_text = "";          // the function that makes a text of a value; "": it is one
  };
  virtual InCpp in_cpp() const = 0;

 protected:
  bool is_writable() const;  // until generate() has run
  // CompileError once generate() has run: the value would come too late.
  void check_writable() const;
  [[noreturn]] void refuse(const std::string& value, const std::string& rule,
                           const std::string& evidence, const std::string& instead) const;

 private:
  std::string name_;
};

// ---- values as text; nullopt when the text is not one ----

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

// A value as set_from_string reads it.
inline std::string param_text(bool value) { return value ? "true" : "false"; }
template <typename T>
std::string param_text(T value) {
  return number_text(value);
}

// Whether `from` keeps its value as a To: floats may round, whole numbers may not.
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

template <typename T>
class GeneratorParam : public internal::GeneratorParamBase {
  static constexpr bool is_number = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;
  static constexpr bool is_text = std::is_same_v<T, std::string>;

 public:
  GeneratorParam(const std::string& name, const T& value)
      : GeneratorParamBase(name), value_(value) {}
  // Values from min to max.
  GeneratorParam(const std::string& name, const T& value, const T& min,
                 const T& max) requires is_number : GeneratorParamBase(name),
                                                    min_(min),
                                                    max_(max) {
    assign(value);
  }
  GeneratorParam(const std::string& name, const T& value,
                 const std::map<std::string, T>& choices) requires std::is_enum_v<T>
      : GeneratorParamBase(name), value_(value), choices_(choices) {
    to_string();  // the default is one of the choices
  }

  T value() const { return value_; }
  operator T() const { return value_; }
  operator Expr() const requires std::is_arithmetic_v<T> { return Expr(value_); }

  // Where it is a LoopLevel: after generate() too, which has given it to schedules. They follow it.
  void set(const LoopLevel& level) requires std::is_same_v<T, LoopLevel> {
    if (is_writable())
      value_ = level;
    else
      value_.set(level);
  }
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
  void set_from_string(const std::string& text) override;
  void set_from_loop_level(const LoopLevel& level) override {
    if constexpr (std::is_same_v<T, LoopLevel>)
      set(level);
    else
      GeneratorParamBase::set_from_loop_level(level);
  }
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
  if (!value) refuse_value(text, "this is none of them");
  assign(*value);
}

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
    return {};  // of every generator: target and machine, which the context says
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

// ---- a param in arithmetic stands for its value: levels - 1, gain * in(x), a && b ----

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
template <typename T>
auto operator-(const GeneratorParam<T>& a) -> decltype(-a.value()) {
  return -a.value();
}
template <typename T>
std::ostream& operator<<(std::ostream& out, const GeneratorParam<T>& a) {
  return out << a.to_string();
}
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
RETROGRADE_PARAM_EXTREME(min)  // of numbers std's, of Exprs ours
RETROGRADE_PARAM_EXTREME(max)  // of numbers std's, of Exprs ours
#undef RETROGRADE_PARAM_EXTREME

}  // namespace retrograde
