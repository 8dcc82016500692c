#include "ir/parse_expr.h"

#include <charconv>
#include <limits>
#include <optional>

#include "ir/build.h"

namespace retrograde::ir {

namespace {

// The type of a suffix: "_u8", "_f64", or "f" for float32.
std::optional<Type> suffix_type(const std::string& suffix) {
  if (suffix == "f") return Float(32);
  static const std::pair<const char*, const char*> prefixes[] = {
      {"_i", "int"}, {"_u", "uint"}, {"_f", "float"}, {"_bf", "bfloat"}};
  for (const auto& [short_name, long_name] : prefixes) {
    Type type;
    const std::string prefix = short_name;
    if (suffix.rfind(prefix, 0) == 0 && read_type(long_name + suffix.substr(prefix.size()), type))
      return type;
  }
  return std::nullopt;
}

Expr special_float(const std::string& word, bool negative) {
  const bool is_nan = word.rfind("nan_", 0) == 0;
  if (!is_nan && word.rfind("inf_", 0) != 0) return {};
  const std::optional<Type> type = suffix_type(word.substr(3));
  if (!type || !type->is_float()) return {};
  const double infinity = std::numeric_limits<double>::infinity();
  return make_const(*type, is_nan     ? std::numeric_limits<double>::quiet_NaN()
                           : negative ? -infinity
                                      : infinity);
}

}  // namespace

Expr ExprParser::whole_expr() {
  Expr e = expr();
  if (!at_end()) fail("the end of the expression");
  return e;
}

void ExprParser::refuse_operands(const Token& at, const InternalError& error) {
  const std::string what = error.what();
  user_error("read IR text",
             text("line ", at.line, ", column ", at.column, ": operands must fit each other"),
             what.substr(0, what.find('\n')), "Cast an operand, or write its type after a colon");
}

Type ExprParser::type_suffix(NameUse use, const std::string& name, int lanes, int component) {
  const Type result = accept(":") ? type() : types_.implied(use, name, lanes, component);
  types_.mention(use, name, use == NameUse::Variable ? result : result.element_of(), component);
  return result;
}

Expr ExprParser::expr() { return infix(0); }

const InfixOperator* ExprParser::infix_ahead() const {
  return token().kind == Token::Kind::Punctuation ? infix_operator(token().text) : nullptr;
}

Expr ExprParser::infix(int min_precedence) {
  const Depth depth(*this);
  Expr left = prefix();
  for (const InfixOperator* op = infix_ahead(); op && op->precedence >= min_precedence;
       op = infix_ahead()) {
    const Token at = take();
    Expr right = infix(op->precedence + 1);
    left = build(at, [&] { return binary(op->kind, left, right); });
  }
  return left;
}

Expr ExprParser::prefix() {
  const Depth depth(*this);
  const Token at = token();
  if (accept("-")) return number(true);
  if (accept("!")) {
    Expr a = prefix();
    return build(at, [&] { return logical_not(a); });
  }
  if (is("{")) return shared_block();
  if (is("(")) {
    take();
    return is("let") ? let_expr() : expr_before(")");
  }
  switch (token().kind) {
    case Token::Kind::Number:
      return number(false);
    case Token::Kind::String:
      return Expr(take().text);
    case Token::Kind::Shared: {
      const auto found = shared_.find(token().text);
      if (found == shared_.end()) fail("a shared node defined before");
      take();
      return found->second;
    }
    case Token::Kind::Name:
      return named();
    default:
      fail("an expression");
  }
}

Expr ExprParser::number(bool negative) {
  if (token().kind == Token::Kind::Name) {
    Expr special = special_float(token().text, negative);
    if (!special.defined()) fail("a number");
    take();
    return special;
  }
  if (token().kind != Token::Kind::Number) fail("a number");
  const std::string literal = (negative ? "-" : "") + token().text;
  const char* const end = literal.data() + literal.size();
  size_t digits = literal.find_first_of("_f");
  if (digits == std::string::npos) digits = literal.size();
  const std::optional<Type> type =
      digits == literal.size() ? Int(32) : suffix_type(literal.substr(digits));
  if (!type) fail("a number with a known suffix");
  Expr result;
  const char* stop = nullptr;
  const auto read = [&](auto value) {
    stop = std::from_chars(literal.data(), end, value).ptr;
    return value;
  };
  if (type->is_float()) {
    result = make_const(*type, read(0.0));
  } else if (type->is_uint()) {
    const auto value = read(uint64_t{0});
    if (type->can_represent(value)) result = make_uint_const(*type, value);
  } else {
    const auto value = read(int64_t{0});
    if (type->can_represent(value)) result = make_const(*type, value);
  }
  if (stop != literal.data() + digits || !result.defined()) fail("a number that fits its type");
  take();
  return result;
}

Expr ExprParser::shared_block() {
  const auto outer = shared_;
  expect("{");
  while (token().kind == Token::Kind::Shared && ahead_is("=")) {
    const std::string name = take().text;
    take();
    shared_[name] = expr_before(";");
  }
  Expr result = expr_before("}");
  shared_ = outer;
  return result;
}

Expr ExprParser::let_expr() {
  expect("let");
  const std::string bound = name();
  expect("=");
  Expr value = expr_before("in");
  types_.declare(NameUse::Variable, bound, value.type());
  return make_let(bound, value, expr_before(")"));
}

Expr ExprParser::named() {
  if (token().quoted) return ahead_is("(") ? call(CallType::Func) : load(take().text);
  if (is("true") || is("false")) return make_uint_const(Bool(), take().text == "true");
  if (Expr special = special_float(token().text, false); special.defined()) {
    take();
    return special;
  }
  if (accept("image")) return call(CallType::Image);
  if (accept("extern")) return call(CallType::Extern);
  if (is_reserved(token().text)) return keyword_call(token());
  return ahead_is("(") ? call(CallType::Func) : load(take().text);
}

Expr ExprParser::keyword_call(const Token& keyword) {
  // A copy, because `keyword` may refer to the current token, which advances.
  const Token at = keyword;  // NOLINT(performance-unnecessary-copy-initialization)
  Type type_name;
  if (read_type(at.text, type_name)) {
    take();
    const std::vector<Expr> args = arguments(1);
    return build(at, [&] { return cast_to(type_name, args[0]); });
  }
  if (accept("min") || accept("max")) {
    const std::vector<Expr> args = arguments(2);
    return build(
        at, [&] { return binary(at.text == "min" ? Kind::Min : Kind::Max, args[0], args[1]); });
  }
  if (accept("select")) {
    const std::vector<Expr> args = arguments(3);
    return build(at, [&] { return make_select(args[0], args[1], args[2]); });
  }
  if (accept("reinterpret")) {
    const Type to = type_in("<", ">");
    const std::vector<Expr> args = arguments(1);
    return build(at, [&] { return reinterpret_as(to, args[0]); });
  }
  if (is("ramp") || is("broadcast")) {
    const bool is_ramp = take().text == "ramp";
    expect("(");
    Expr first = expr_before(","), stride = is_ramp ? expr_before(",") : Expr();
    const int lanes = integer();
    expect(")");
    return build(at, [&] {
      return is_ramp ? make_ramp(first, stride, lanes) : make_broadcast(first, lanes);
    });
  }
  if (is("shuffle")) return shuffle();
  if (is("reduce")) return reduce();
  const Op op = op_from_name(at.text);
  if (op == Op::none) fail("an expression");
  return operator_call(op);
}

Expr ExprParser::operator_call(Op op) {
  const Token at = take();
  std::optional<Type> result;
  if (is("<")) result = type_in("<", ">");
  expect("(");
  std::vector<Expr> args = expr_list(")");
  return build(at, [&] { return result ? call_op(op, *result, args) : call_op(op, args); });
}

Expr ExprParser::call(CallType call_type) {
  const std::string callee = name();
  expect("(");
  std::vector<Expr> args = expr_list(")");
  const int component = accept(".") ? integer() : 0;
  const Type result = type_suffix(NameUse::Call, callee, lanes_of(args), component);
  return make_node<Call>(result, call_type, Op::none, callee, std::move(args), component,
                         SymbolRef());
}

Expr ExprParser::load(const std::string& name) {
  const Token at = token();
  if (!accept("[")) return variable(name, type_suffix(NameUse::Variable, name, 1));
  Expr index = expr(), predicate;
  if (accept("if")) predicate = expr();
  expect("]");
  const Type result = type_suffix(NameUse::Buffer, name, index.type().lanes());
  return make_load(result, name, index, predicate);
}

Expr ExprParser::shuffle() {
  const Token at = take();
  expect("(");
  const std::vector<Expr> vectors = several([&] { return expr(); });
  expect(";");
  const std::vector<int> indices = several([&] { return integer(); });
  expect(")");
  return build(at, [&] { return make_shuffle(vectors, indices); });
}

Expr ExprParser::reduce() {
  const Token at = take();
  expect("(");
  std::optional<Kind> op;
  for (Kind candidate : {Kind::Add, Kind::Mul, Kind::Min, Kind::Max, Kind::And, Kind::Or}) {
    if (is(kind_word(candidate).c_str())) op = candidate;
  }
  if (!op) fail("add, mul, min, max, and, or");
  take();
  expect(",");
  Expr value = expr_before(",");
  const int lanes = integer();
  expect(")");
  return build(at, [&] { return make_vector_reduce(*op, value, lanes); });
}

Expr ExprParser::expr_before(const char* mark) {
  Expr e = expr();
  expect(mark);
  return e;
}

Expr ExprParser::expr_behind(const char* mark) {
  expect(mark);
  return expr();
}

std::vector<Expr> ExprParser::expr_list(const char* close) {
  if (accept(close)) return {};
  std::vector<Expr> result = several([&] { return expr(); });
  expect(close);
  return result;
}

std::vector<Expr> ExprParser::arguments(size_t count) {
  const Token at = token();
  expect("(");
  std::vector<Expr> result = expr_list(")");
  if (result.size() != count) Lexer::fail(at, text(count, " arguments"));
  return result;
}

}  // namespace retrograde::ir
