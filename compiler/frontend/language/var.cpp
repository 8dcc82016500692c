// var.cpp -- names, and the expansion of implicit variables.
#include "frontend/language/var.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <ostream>

#include "ir/literal.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde {

namespace {

bool is_identifier(const std::string& name) {
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0]))) return false;
  return std::all_of(name.begin(), name.end(),
                     [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '$'; });
}

const std::string& checked_name(const std::string& name) {
  if (!is_identifier(name)) {
    user_error("make a Var named " + quoted(name),
               "the name of a Var is an identifier: letters, digits, _ and $",
               quoted(name) + " is not", "Choose a name such as \"x\" or \"x_outer\"");
  }
  return name;  // NOLINT(bugprone-return-const-ref-from-parameter): used within the full expression
}

}  // namespace

namespace frontend {
std::string name_from(const char* text, const char* of) {
  if (text) return text;
  user_error(retrograde::text("name ", of), "a name is text", "the pointer to it is null",
             "Give it a text, or none at all");
}
}  // namespace frontend

// Generated names of Vars have a counter of their own; print_loop_nest shows "v$0" as v0.
Var::Var() : expr_() {
  static std::atomic<uint64_t> next{0};
  name_ = text("v$", next++);
  expr_ = ir::variable(name_);
}

// An implicit variable determines how many dimensions its definition has, even in f(_) * 0.
Var::Var(const std::string& name)
    : name_(checked_name(name)),
      expr_(is_implicit() ? ir::loose_variable(name_) : ir::variable(name_)) {}

Var Var::implicit(int n) { return Var(graph::implicit_name(n)); }

std::ostream& operator<<(std::ostream& out, const Var& var) { return out << var.name(); }

namespace frontend {

namespace {

// Coordinates are int32. Floats are rejected because their rounding would be a guess.
Expr as_coordinate(const Expr& e, int dimension, const std::string& what) {
  const std::string asked = text("read dimension ", dimension, " of ", what);
  if (!e.defined())
    user_error(asked, "a coordinate must be a defined expression", "this one was never assigned",
               "Assign every Expr before it is used");
  if (!e.type().is_int_or_uint() || !e.type().is_scalar()) {
    user_error(asked, "coordinates are integers",
               text("the coordinate ", e, " has type ", to_string(e.type())),
               "Convert it: cast<int>(floor(e)) or cast<int>(round(e))");
  }
  return int32_literal(e, asked);
}

}  // namespace

int placeholder_position(const std::vector<Expr>& args) {
  for (size_t i = 0; i < args.size(); i++) {
    const Variable* v = args[i].as<Variable>();
    if (v && Var::is_placeholder(v->name)) return static_cast<int>(i);
  }
  return -1;
}

std::vector<Expr> expand_placeholder(const std::vector<Expr>& args, int count) {
  const int position = placeholder_position(args);
  if (position < 0) return args;
  std::vector<Expr> result(args.begin(), args.begin() + position);
  for (int i = 0; i < count; i++) result.push_back(Var::implicit(i));
  result.insert(result.end(), args.begin() + position + 1, args.end());
  return result;
}

std::vector<Expr> access_coordinates(const std::vector<Expr>& args, int dimensions,
                                     const std::string& what) {
  const int missing = dimensions - (static_cast<int>(args.size()) - 1);
  std::vector<Expr> expanded = missing >= 0 ? expand_placeholder(args, missing) : args;
  if (static_cast<int>(expanded.size()) != dimensions) {
    user_error(
        "read " + what, "an access gives one coordinate for each dimension",
        text("it has ", dimensions, " dimensions and was given ", args.size(), " coordinates"),
        "Give every coordinate, or write _ for those that follow the left-hand side");
  }
  for (size_t i = 0; i < expanded.size(); i++)
    expanded[i] = as_coordinate(expanded[i], static_cast<int>(i), what);
  return expanded;
}

int implicit_count(const std::vector<Expr>& values) {
  int count = 0;
  for (const Expr& value : values) {
    if (!value.defined()) continue;
    walk(value,
         [&](const Variable& v) { count = std::max(count, Var::implicit_index(v.name) + 1); });
  }
  return count;
}

}  // namespace frontend
}  // namespace retrograde
