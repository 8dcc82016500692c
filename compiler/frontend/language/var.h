// var.h -- names of dimensions: Var, the implicit variables _, _0 ... _9.
//
// Var x, y; f(x, y) = x + y. A Var is nothing but its name: two Vars of one name are the same Var.
#pragma once

#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

#include "graph/names.h"
#include "ir/build.h"

namespace retrograde {

namespace frontend {
// A pointer to text. A literal 0, which converts to every pointer, is none: it means a number.
template <typename T>
concept TextPointer = std::is_same_v < std::decay_t<T>,
const char* > || std::is_same_v<std::decay_t<T>, char*>;
// CompileError when there is no text. `of` names what it is for: "a Var".
std::string name_from(const char* text, const char* of);
}  // namespace frontend

class Var {
 public:
  Var();  // a fresh name
  // Requires: the name of a Var is an identifier: letters, digits, _ and $; a name is text.
  Var(const std::string& name);
  template <frontend::TextPointer T>
  Var(const T& name) : Var(frontend::name_from(name, "a Var")) {}
  explicit Var(std::nullptr_t) = delete;  // and of a literal 0

  const std::string& name() const { return name_; }                      // all that a Var is
  bool same_as(const Var& other) const { return name_ == other.name_; }  // whether the names agree

  // _0, _1 ...: what the placeholder _ stands for, dimension by dimension.
  static Var implicit(int n);
  static bool is_implicit(const std::string& name) { return graph::implicit_index(name) >= 0; }
  // -1: not implicit
  static int implicit_index(const std::string& name) { return graph::implicit_index(name); }
  static bool is_placeholder(const std::string& name) { return graph::is_placeholder(name); }
  bool is_implicit() const { return is_implicit(name_); }
  int implicit_index() const { return implicit_index(name_); }
  bool is_placeholder() const { return is_placeholder(name_); }

  // A loop of one iteration around all others of a stage.
  static Var outermost() { return Var(graph::outermost_loop); }

  operator const Expr&() const { return expr_; }

 private:
  std::string name_;
  Expr expr_;
};

template <int N = -1>
struct ImplicitVar {
  Var to_var() const { return N >= 0 ? Var::implicit(N) : Var("_"); }
  operator Var() const { return to_var(); }
  operator Expr() const { return to_var(); }
};

inline constexpr ImplicitVar<> _;
inline constexpr ImplicitVar<0> _0;
inline constexpr ImplicitVar<1> _1;
inline constexpr ImplicitVar<2> _2;
inline constexpr ImplicitVar<3> _3;
inline constexpr ImplicitVar<4> _4;
inline constexpr ImplicitVar<5> _5;
inline constexpr ImplicitVar<6> _6;
inline constexpr ImplicitVar<7> _7;
inline constexpr ImplicitVar<8> _8;
inline constexpr ImplicitVar<9> _9;

std::ostream& operator<<(std::ostream& out, const Var& var);

namespace frontend {

// Arguments of an access with the placeholder _ replaced by `count` implicit variables. Position of
// the placeholder, or -1, goes to `placeholder`.
std::vector<Expr> expand_placeholder(const std::vector<Expr>& args, int count);
int placeholder_position(const std::vector<Expr>& args);  // -1: none
// Coordinates of a call: `args` for an entity of `dimensions`, placeholder expanded, as int32.
// `what` names the entity in messages: "Func \"f\"".
std::vector<Expr> access_coordinates(const std::vector<Expr>& args, int dimensions,
                                     const std::string& what);
// One more than the largest implicit variable used; 0 when none is.
int implicit_count(const std::vector<Expr>& values);

}  // namespace frontend
}  // namespace retrograde
