// A recursive-descent parser of IR text; print.cpp shows the language.
#include "ir/parse.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>
#include <type_traits>
#include <unordered_map>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/lexer.h"
#include "ir/text.h"

namespace retrograde::ir {

namespace {

// The C++ stack limits the nesting depth of a text.
constexpr int max_depth = 2000;

constexpr ForType for_types[] = {ForType::Serial,   ForType::Parallel, ForType::Vectorized,
                                 ForType::Unrolled, ForType::GpuBlock, ForType::GpuThread,
                                 ForType::GpuLane};

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

class Parser {
 public:
  explicit Parser(const std::string& text, NameTypes types = {})
      : lexer_(text), token_(lexer_.next()), ahead_(lexer_.next()), types_(std::move(types)) {}

  Expr whole_expr() {
    Expr e = expr();
    if (!at_end()) fail("the end of the expression");
    return e;
  }
  Stmt whole_stmt() {
    Stmt s = block_rest();
    if (!at_end()) fail("a statement");
    return s;
  }

 private:
  // ---- tokens ----
  bool at_end() const { return token_.kind == Token::Kind::End; }
  bool is(const char* text) const {
    if (token_.kind == Token::Kind::Name) return !token_.quoted && token_.text == text;
    return token_.kind == Token::Kind::Punctuation && token_.text == text;
  }
  bool ahead_is(const char* text) const {
    return ahead_.kind == Token::Kind::Punctuation && ahead_.text == text;
  }
  Token take() {
    Token result = std::move(token_);
    token_ = std::move(ahead_);
    ahead_ = lexer_.next();
    return result;
  }
  bool accept(const char* text) {
    if (!is(text)) return false;
    take();
    return true;
  }
  void expect(const char* text) {
    if (!accept(text)) fail(quoted(text));
  }
  [[noreturn]] void fail(const std::string& expected) const { Lexer::fail(token_, expected); }
  std::string name() {
    if (token_.kind != Token::Kind::Name) fail("a name");
    return take().text;
  }
  int integer() {
    int value = 0;
    const std::string& digits = token_.text;
    const auto end = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (token_.kind != Token::Kind::Number || end.ptr != digits.data() + digits.size())
      fail("an integer");
    take();
    return value;
  }
  Type type() {
    Type result;
    if (token_.kind != Token::Kind::Name || !read_type(token_.text, result)) fail("a type");
    take();
    return result;
  }
  // The type written after a mention of a name, or else the implied one.
  Type type_suffix(NameUse use, const std::string& name, int lanes, int component = 0) {
    const Type result = accept(":") ? type() : types_.implied(use, name, lanes, component);
    types_.mention(use, name, use == NameUse::Variable ? result : result.element_of(), component);
    return result;
  }

  // Runs a builder and reports its error at the position in the text.
  template <class F>
  auto build(const Token& at, F make) {
    try {
      return make();
    } catch (const InternalError& error) {
      const std::string what = error.what();
      user_error("read IR text",
                 text("line ", at.line, ", column ", at.column, ": operands must fit each other"),
                 what.substr(0, what.find('\n')),
                 "Cast an operand, or write its type after a colon");
    }
  }

  // ---- expressions ----
  struct Depth {
    explicit Depth(Parser& parser) : parser(parser) {
      if (++parser.depth_ > max_depth) parser.fail("a text that nests less deeply");
    }
    ~Depth() { --parser.depth_; }
    Parser& parser;
  };
  Expr expr() { return infix(0); }
  const InfixOperator* infix_ahead() const {
    return token_.kind == Token::Kind::Punctuation ? infix_operator(token_.text) : nullptr;
  }
  Expr infix(int min_precedence) {
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
  Expr prefix() {
    const Depth depth(*this);
    const Token at = token_;
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
    switch (token_.kind) {
      case Token::Kind::Number:
        return number(false);
      case Token::Kind::String:
        return Expr(take().text);
      case Token::Kind::Shared: {
        const auto found = shared_.find(token_.text);
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
  Expr number(bool negative) {
    if (token_.kind == Token::Kind::Name) {
      Expr special = special_float(token_.text, negative);
      if (!special.defined()) fail("a number");
      take();
      return special;
    }
    if (token_.kind != Token::Kind::Number) fail("a number");
    const std::string literal = (negative ? "-" : "") + token_.text;
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
  Expr shared_block() {
    const auto outer = shared_;
    expect("{");
    while (token_.kind == Token::Kind::Shared && ahead_is("=")) {
      const std::string name = take().text;
      take();
      shared_[name] = expr_before(";");
    }
    Expr result = expr_before("}");
    shared_ = outer;
    return result;
  }
  Expr let_expr() {
    expect("let");
    const std::string bound = name();
    expect("=");
    Expr value = expr_before("in");
    types_.declare(NameUse::Variable, bound, value.type());
    return make_let(bound, value, expr_before(")"));
  }
  Expr named() {
    if (token_.quoted) return ahead_is("(") ? call(CallType::Func) : load(take().text);
    if (is("true") || is("false")) return make_uint_const(Bool(), take().text == "true");
    if (Expr special = special_float(token_.text, false); special.defined()) {
      take();
      return special;
    }
    if (accept("image")) return call(CallType::Image);
    if (accept("extern")) return call(CallType::Extern);
    if (is_reserved(token_.text)) return keyword_call(token_);
    return ahead_is("(") ? call(CallType::Func) : load(take().text);
  }
  Expr keyword_call(const Token& keyword) {
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
  Expr operator_call(Op op) {
    const Token at = take();
    std::optional<Type> result;
    if (is("<")) result = type_in("<", ">");
    expect("(");
    std::vector<Expr> args = expr_list(")");
    return build(at, [&] { return result ? call_op(op, *result, args) : call_op(op, args); });
  }
  Expr call(CallType call_type) {
    const std::string callee = name();
    expect("(");
    std::vector<Expr> args = expr_list(")");
    const int component = accept(".") ? integer() : 0;
    const Type result = type_suffix(NameUse::Call, callee, lanes_of(args), component);
    return make_node<Call>(result, call_type, Op::none, callee, std::move(args), component,
                           SymbolRef());
  }
  // A load, or a variable when no bracket follows.
  Expr load(const std::string& name) {
    const Token at = token_;
    if (!accept("[")) return variable(name, type_suffix(NameUse::Variable, name, 1));
    Expr index = expr(), predicate;
    if (accept("if")) predicate = expr();
    expect("]");
    const Type result = type_suffix(NameUse::Buffer, name, index.type().lanes());
    return make_load(result, name, index, predicate);
  }
  Expr shuffle() {
    const Token at = take();
    expect("(");
    const std::vector<Expr> vectors = several([&] { return expr(); });
    expect(";");
    const std::vector<int> indices = several([&] { return integer(); });
    expect(")");
    return build(at, [&] { return make_shuffle(vectors, indices); });
  }
  Expr reduce() {
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
  // An expression followed, or preceded, by a mark.
  Expr expr_before(const char* mark) {
    Expr e = expr();
    expect(mark);
    return e;
  }
  Expr expr_behind(const char* mark) {
    expect(mark);
    return expr();
  }
  Type type_in(const char* open, const char* close) {
    expect(open);
    const Type result = type();
    expect(close);
    return result;
  }
  template <class Read>
  std::vector<std::invoke_result_t<const Read&>> several(const Read& read) {
    std::vector<decltype(read())> result;
    do result.push_back(read());
    while (accept(","));
    return result;
  }
  std::vector<Expr> expr_list(const char* close) {
    if (accept(close)) return {};
    std::vector<Expr> result = several([&] { return expr(); });
    expect(close);
    return result;
  }
  std::vector<Expr> arguments(size_t count) {
    const Token at = token_;
    expect("(");
    std::vector<Expr> result = expr_list(")");
    if (result.size() != count) Lexer::fail(at, text(count, " arguments"));
    return result;
  }

  // ---- statements ----
  Stmt block_rest() {
    std::vector<Stmt> stmts;
    while (!at_end() && !is("}")) stmts.push_back(stmt());
    return make_block(std::move(stmts));
  }
  Stmt block() {
    const Depth depth(*this);
    expect("{");
    Stmt s = block_rest();
    expect("}");
    return s;
  }
  Stmt stmt() {
    const Depth depth(*this);
    if (is("{")) return block();
    if (accept("let")) {
      const std::string bound = name();
      Expr value = expr_behind("=");
      types_.declare(NameUse::Variable, bound, value.type());
      return make_let(bound, value, block_rest());
    }
    if (accept("assert")) {
      const std::vector<Expr> args = arguments(2);
      return make_assert(args[0], args[1]);
    }
    if (is("produce") || is("consume")) {
      const bool produces = take().text == "produce";
      const std::string func = name();
      return make_producer_consumer(func, produces, block());
    }
    if (is_loop()) return loop();
    if (accept("realize")) return realize();
    if (accept("allocate")) return allocate();
    if (accept("free")) return make_free(name());
    if (accept("if")) return if_stmt();
    if (accept("evaluate")) return make_evaluate(expr());
    if (accept("atomic")) {
      const std::string target = name();
      return make_atomic(target, block());
    }
    if (accept("fork")) {
      Stmt first = block();
      expect("and");
      return make_fork(first, block());
    }
    if (accept("prefetch")) return prefetch();
    if (accept("launch")) return launch();
    return store_or_provide();
  }
  bool is_loop() const {
    if (is("for")) return true;
    if (is(partition_name(Partition::Never)) || is(partition_name(Partition::Always))) return true;
    return std::ranges::any_of(for_types, [&](ForType type) { return is(for_name(type)); });
  }
  Stmt loop() {
    Partition partition = Partition::Auto;
    for (Partition wanted : {Partition::Never, Partition::Always}) {
      if (accept(partition_name(wanted))) partition = wanted;
    }
    ForType runs = ForType::Serial;
    for (ForType wanted : for_types) {
      if (accept(for_name(wanted))) runs = wanted;
    }
    expect("for");
    expect("(");
    const std::string variable = name();
    expect(",");
    Expr min = expr_before(","), extent = expr_before(")");
    types_.declare(NameUse::Variable, variable, Int(32));
    return make_for(variable, min, extent, runs, block(), partition);
  }
  Stmt launch() {
    const std::string kernel = name();
    expect("blocks");
    std::vector<Expr> blocks = arguments(3);
    expect("threads");
    const Token at = token_;
    expect("(");
    std::vector<int> threads = several([&] { return integer(); });
    expect(")");
    if (threads.size() != 3) Lexer::fail(at, "3 numbers of threads");
    expect("shared");
    std::vector<Expr> shared = arguments(1);
    return make_launch(kernel, std::move(blocks), std::move(threads), shared[0], block());
  }
  Stmt realize() {
    const std::string func = name();
    expect("(");
    std::vector<Type> types = several([&] { return type(); });
    expect(")");
    const MemoryType where = memory();
    std::vector<Range> bounds = ranges();
    StorageLayout storage = layout();
    types_.declare_components(func, types);
    return make_realize(func, std::move(types), where, std::move(bounds), block(),
                        std::move(storage));
  }
  StorageLayout layout() {
    StorageLayout result;
    if (accept("order")) {
      expect("(");
      result.order = several([&] { return integer(); });
      expect(")");
    }
    while (accept("fold")) {
      expect("(");
      const auto dimension = static_cast<size_t>(integer());
      expect(",");
      result.folds.resize(std::max(result.folds.size(), dimension + 1));
      result.folds[dimension] = expr();
      expect(")");
    }
    if (accept("in")) result.place = name();
    if (accept("at")) result.first = expr();
    if (accept("lead")) result.lead = integer();
    return result;
  }
  Stmt prefetch() {
    const std::string target = name();
    const Type element = type_in("(", ")");
    return make_prefetch(target, element, ranges());
  }
  std::vector<Range> ranges() {
    if (!is("[")) return {};
    return several([&] {
      expect("[");
      Expr min = expr_before(",");
      return Range{min, expr_before("]")};
    });
  }
  Stmt allocate() {
    const std::string buffer = name();
    expect("[");
    Expr elements = expr_before("]");
    expect(":");
    const Type element = type();
    const MemoryType where = memory();
    const Expr offset = accept("at") ? expr() : Expr();
    types_.declare(NameUse::Buffer, buffer, element);
    return make_allocate(buffer, element, where, elements, block(), offset);
  }
  Stmt if_stmt() {
    expect("(");
    Expr condition = expr_before(")");
    Stmt when_true = block(), when_false;
    if (accept("else")) when_false = block();
    return make_if(condition, when_true, when_false);
  }
  Stmt store_or_provide() {
    const Token at = token_;
    const std::string target = name();
    if (accept("[")) {
      Expr index = expr(), predicate;
      if (accept("if")) predicate = expr();
      expect("]");
      Expr value = expr_behind("=");
      types_.mention(NameUse::Buffer, target, value.type().element_of());
      return build(at, [&] { return make_store(target, value, index, predicate); });
    }
    if (!accept("(")) Lexer::fail(at, "a statement");
    std::vector<Expr> args;
    Expr predicate;
    while (!is(")") && !is("if")) {
      args.push_back(expr());
      if (!accept(",")) break;
    }
    if (accept("if")) predicate = expr();
    expect(")");
    expect("=");
    expect("{");
    std::vector<Expr> values = expr_list("}");
    types_.mention_components(target, values);
    return make_provide(target, std::move(values), std::move(args), predicate);
  }
  MemoryType memory() {
    for (int i = 0; i <= static_cast<int>(MemoryType::AMXTile); ++i) {
      const auto type = static_cast<MemoryType>(i);
      if (accept(memory_name(type))) return type;
    }
    fail("auto, heap, stack or another memory type");
  }

  Lexer lexer_;
  Token token_, ahead_;
  int depth_ = 0;
  NameTypes types_;
  std::unordered_map<std::string, Expr> shared_;
};

}  // namespace

Expr parse_expr(const std::string& text) { return Parser(text).whole_expr(); }
Expr parse_expr(const std::string& text, const NameTypes& declared) {
  return Parser(text, NameTypes(&declared)).whole_expr();
}
Stmt parse_stmt(const std::string& text) { return Parser(text).whole_stmt(); }

}  // namespace retrograde::ir
