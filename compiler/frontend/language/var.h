// var.h -- names of dimensions: Var, the placeholder _ and the implicit variables _0 ... _9.
//
// Var x, y; f(x, y) = x + y;
#pragma once

#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

#include "graph/names.h"
#include "ir/build.h"

namespace retrograde {

namespace frontend {
// A pointer to text. A literal 0 converts to every pointer but means a number, so it does not match.
template <typename T>
concept TextPointer = std::is_same_v < std::decay_t<T>,
const char* > || std::is_same_v<std::decay_t<T>, char*>;
// Throws CompileError if `text` is null. `of` describes the named thing in the message: "a Var".
std::string name_from(const char* text, const char* of);
}  // namespace frontend

// A name for a dimension or a loop. Two Vars with the same name are the same Var.
class Var {
 public:
  Var();  // a generated name
  // Requires: the name of a Var is an identifier: letters, digits, _ and $; a name is text.
  Var(const std::string& name);
  template <frontend::TextPointer T>
  Var(const T& name) : Var(frontend::name_from(name, "a Var")) {}
  explicit Var(std::nullptr_t) = delete;  // and of a literal 0

  const std::string& name() const { return name_; }  // the name
  // Whether the names agree.
  bool same_as(const Var& other) const { return name_ == other.name_; }

  // The implicit variable _n. The placeholder _ expands to _0, _1, ..., one for each dimension.
  static Var implicit(int n);
  // Whether the name is that of an implicit variable.
  static bool is_implicit(const std::string& name) { return graph::implicit_index(name) >= 0; }
  // The n of an implicit variable _n, or -1.
  static int implicit_index(const std::string& name) { return graph::implicit_index(name); }
  // Whether the name is the placeholder _.
  static bool is_placeholder(const std::string& name) { return graph::is_placeholder(name); }
  bool is_implicit() const { return is_implicit(name_); }
  int implicit_index() const { return implicit_index(name_); }
  bool is_placeholder() const { return is_placeholder(name_); }

  // A loop of one iteration around all other loops of a stage.
  static Var outermost() { return Var(graph::outermost_loop); }

  // The variable as an Expr.
  operator const Expr&() const { return expr_; }

 private:
  std::string name_;
  Expr expr_;
};

// The type of the constants _ and _0 ... _9: an implicit variable, or the placeholder if N is -1.
template <int N = -1>
struct ImplicitVar {
  // The Var with this name.
  Var to_var() const { return N >= 0 ? Var::implicit(N) : Var("_"); }
  // Converts to the Var with this name.
  operator Var() const { return to_var(); }
  // Converts to the variable as an Expr.
  operator Expr() const { return to_var(); }
};

// The placeholder: f(x, _) expands it to as many implicit variables as dimensions are missing.
inline constexpr ImplicitVar<> _;
inline constexpr ImplicitVar<0> _0;  // implicit variable of the first dimension that _ covers
inline constexpr ImplicitVar<1> _1;  // implicit variable of the second dimension
inline constexpr ImplicitVar<2> _2;  // implicit variable of the third dimension
inline constexpr ImplicitVar<3> _3;  // implicit variable of the fourth dimension
inline constexpr ImplicitVar<4> _4;  // implicit variable of the fifth dimension
inline constexpr ImplicitVar<5> _5;  // implicit variable of the sixth dimension
inline constexpr ImplicitVar<6> _6;  // implicit variable of the seventh dimension
inline constexpr ImplicitVar<7> _7;  // implicit variable of the eighth dimension
inline constexpr ImplicitVar<8> _8;  // implicit variable of the ninth dimension
inline constexpr ImplicitVar<9> _9;  // implicit variable of the tenth dimension

// Prints the name.
std::ostream& operator<<(std::ostream& out, const Var& var);

namespace frontend {

// Replaces the placeholder _ in the arguments of an access by `count` implicit variables.
std::vector<Expr> expand_placeholder(const std::vector<Expr>& args, int count);
// Position of the placeholder in `args`, or -1.
int placeholder_position(const std::vector<Expr>& args);
// Coordinates of an access as int32, with the placeholder expanded to reach `dimensions`. `what` describes
// the accessed entity in messages: "Func \"f\"".
std::vector<Expr> access_coordinates(const std::vector<Expr>& args, int dimensions,
                                     const std::string& what);
// One more than the largest index of an implicit variable in `values`; 0 if there is none.
int implicit_count(const std::vector<Expr>& values);

}  // namespace frontend
}  // namespace retrograde
