// A recursive-descent parser of IR text; print.cpp shows the language.
#include "ir/parse.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/parse_expr.h"

namespace retrograde::ir {

namespace {

constexpr ForType for_types[] = {ForType::Serial,   ForType::Parallel, ForType::Vectorized,
                                 ForType::Unrolled, ForType::GpuBlock, ForType::GpuThread,
                                 ForType::GpuLane};

class StmtParser : public ExprParser {
 public:
  using ExprParser::ExprParser;

  Stmt whole_stmt() {
    Stmt s = block_rest();
    if (!at_end()) fail("a statement");
    return s;
  }

 private:
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
      types().declare(NameUse::Variable, bound, value.type());
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
    types().declare(NameUse::Variable, variable, Int(32));
    return make_for(variable, min, extent, runs, block(), partition);
  }
  Stmt launch() {
    const std::string kernel = name();
    expect("blocks");
    std::vector<Expr> blocks = arguments(3);
    expect("threads");
    const Token at = token();
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
    std::vector<Type> elements = several([&] { return type(); });
    expect(")");
    const MemoryType where = memory();
    std::vector<Range> bounds = ranges();
    StorageLayout storage = layout();
    types().declare_components(func, elements);
    return make_realize(func, std::move(elements), where, std::move(bounds), block(),
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
    types().declare(NameUse::Buffer, buffer, element);
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
    const Token at = token();
    const std::string target = name();
    if (accept("[")) {
      Expr index = expr(), predicate;
      if (accept("if")) predicate = expr();
      expect("]");
      Expr value = expr_behind("=");
      types().mention(NameUse::Buffer, target, value.type().element_of());
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
    types().mention_components(target, values);
    return make_provide(target, std::move(values), std::move(args), predicate);
  }
  MemoryType memory() {
    for (int i = 0; i <= static_cast<int>(MemoryType::AMXTile); ++i) {
      const auto type = static_cast<MemoryType>(i);
      if (accept(memory_name(type))) return type;
    }
    fail("auto, heap, stack or another memory type");
  }
};

}  // namespace

Expr parse_expr(const std::string& text) { return ExprParser(text).whole_expr(); }
Expr parse_expr(const std::string& text, const NameTypes& declared) {
  return ExprParser(text, NameTypes(&declared)).whole_expr();
}
Stmt parse_stmt(const std::string& text) { return StmtParser(text).whole_stmt(); }

}  // namespace retrograde::ir
