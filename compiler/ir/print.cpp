// Prints IR as text: print_expr.cpp describes expressions.
//
// Statements
//   let t = v                                        its body is the rest of the block
//   assert(c, e)  free a  evaluate v  a[i if p] = v  f(x, y if p) = {u, v}
//   produce f {..}  consume f {..}  if (c) {..} else {..}  {..}
//   for (x, min, extent) {..}                        serial, or with parallel, vectorized, unrolled,
//                                                    gpu_block, gpu_thread, gpu_lane
//   launch k blocks(x, y, z) threads(32, 8, 1) shared(bytes) {..}
//   realize f(float32, int8) auto [min, extent], [min, extent] order(1, 0) fold(1, 4) in g at first lead 2 {..}
//                                                    the layout: only what differs from the default
//   allocate a[elements]:float32 heap {..}           in a kernel's shared memory: gpu_shared at bytes {..}
#include "ir/print.h"

#include <ostream>

#include "diagnostics/error.h"
#include "ir/print_expr.h"
#include "ir/text.h"
#include "ir/visit.h"

namespace retrograde {

namespace ir {

namespace {

// Appends statements, line by line.
class StmtPrinter {
 public:
  explicit StmtPrinter(std::string& out) : out_(out) {}

  void print(const Stmt& s) {
    if (const auto* block = s.as<Block>()) return print_block(*block);
    put(margin());
    match(
        s,
        [&](const LetStmt& n) {
          write("let ", quote_name(n.name), " = ", n.value, "\n");
          types_.declare(NameUse::Variable, n.name, n.value.type());
          print(n.body);
        },
        [&](const Assert& n) { write("assert(", n.condition, ", ", n.error, ")"); },
        [&](const ProducerConsumer& n) {
          write(n.produces ? "produce " : "consume ", quote_name(n.name), Body{n.body});
        },
        [&](const For& n) { print_loop(n); },
        [&](const Store& n) {
          write(quote_name(n.name), "[", n.index, If{n.predicate}, "] = ", n.value);
          types_.mention(NameUse::Buffer, n.name, n.value.type().element_of());
        },
        [&](const Provide& n) {
          write(quote_name(n.name), "(", n.args, If{n.predicate}, ") = {", n.values, "}");
          types_.mention_components(n.name, n.values);
        },
        [&](const Realize& n) {
          write("realize ", quote_name(n.name), "(",
                listed(n.types, [](Type type) { return to_string(type); }), ") ",
                memory_name(n.memory), n.bounds);
          put(n.layout);
          types_.declare_components(n.name, n.types);
          put(Body{n.body});
        },
        [&](const Allocate& n) {
          write("allocate ", quote_name(n.name), "[", n.elements, "]:", to_string(n.type), " ",
                memory_name(n.memory));
          if (n.offset.defined()) write(" at ", n.offset);
          types_.declare(NameUse::Buffer, n.name, n.type);
          put(Body{n.body});
        },
        [&](const Free& n) { write("free ", quote_name(n.name)); },
        [&](const IfThenElse& n) {
          write("if (", n.condition, ")", Body{n.when_true});
          if (n.when_false.defined()) write(" else", Body{n.when_false});
        },
        [&](const Evaluate& n) { write("evaluate ", n.value); },
        [&](const Atomic& n) { write("atomic ", quote_name(n.name), Body{n.body}); },
        [&](const Fork& n) { write("fork", Body{n.first}, " and", Body{n.rest}); },
        [&](const Prefetch& n) {
          write("prefetch ", quote_name(n.name), "(", to_string(n.type), ")", n.bounds);
        },
        [&](const Launch& n) {
          write("launch ", quote_name(n.name), " blocks(", n.blocks, ") threads(",
                listed(n.threads, [](int count) { return std::to_string(count); }), ") shared(",
                n.shared_bytes, ")", Body{n.body});
        },
        [&](const StmtNode& n) { put(kind_name(n.kind)); });
    if (s.kind() != Kind::LetStmt) put("\n");
  }

 private:
  // The body of a statement, in braces.
  struct Body {
    const Stmt& stmt;
  };
  struct If {
    const Expr& predicate;
  };
  void put(const char* text) { out_ += text; }
  void put(const std::string& text) { out_ += text; }
  void put(const Expr& e) { print_expr(e, types_, out_); }
  void put(const std::vector<Expr>& list) {
    for (size_t i = 0; i < list.size(); ++i) write(i ? ", " : "", list[i]);
  }
  void put(const std::vector<Range>& bounds) {
    for (size_t i = 0; i < bounds.size(); ++i)
      write(i ? ", [" : " [", bounds[i].min, ", ", bounds[i].extent, "]");
  }
  void put(const StorageLayout& layout) {
    if (!layout.order.empty())
      write(" order(", listed(layout.order, [](int d) { return std::to_string(d); }), ")");
    for (size_t d = 0; d < layout.folds.size(); d++)
      if (layout.folds[d].defined()) write(" fold(", std::to_string(d), ", ", layout.folds[d], ")");
    if (!layout.place.empty()) write(" in ", quote_name(layout.place));
    if (layout.first.defined()) write(" at ", layout.first);
    if (layout.lead != 1) write(" lead ", std::to_string(layout.lead));
  }
  void put(If store) {
    if (store.predicate.defined()) write(" if ", store.predicate);
  }
  void put(Body body) {
    put(" ");
    put_braces(body.stmt);
  }
  void put_braces(const Stmt& s) {
    put("{\n");
    ++indent_;
    if (s.defined()) print(s);
    --indent_;
    write(margin(), "}");
  }
  template <class... Parts>
  void write(const Parts&... parts) {
    (put(parts), ...);
  }
  std::string margin() const { return std::string(2 * indent_, ' '); }
  void print_loop(const For& n) {
    if (n.partition != Partition::Auto) write(partition_name(n.partition), " ");
    if (n.runs != ForType::Serial) write(for_name(n.runs), " ");
    write("for (", quote_name(n.name), ", ", n.min, ", ", n.extent, ")");
    types_.declare(NameUse::Variable, n.name, Int(32));
    put(Body{n.body});
  }
  // A let that is not the last statement needs braces, or its body would include what follows.
  void print_block(const Block& n) {
    for (size_t i = 0; i < n.stmts.size(); ++i) {
      if (n.stmts[i].kind() == Kind::LetStmt && i + 1 < n.stmts.size()) {
        put(margin());
        put_braces(n.stmts[i]);
        put("\n");
      } else {
        print(n.stmts[i]);
      }
    }
  }

  std::string& out_;
  NameTypes types_;
  size_t indent_ = 0;
};

}  // namespace

std::string PrintFunction::operator()(const Expr& e) const {
  NameTypes types;
  return (*this)(e, types);
}

std::string PrintFunction::operator()(const Expr& e, NameTypes& types) const {
  if (!e.defined()) return "<undefined>";
  std::string out;
  print_expr(e, types, out);
  return out;
}

std::string PrintFunction::operator()(const Stmt& s) const {
  std::string out;
  if (s.defined()) StmtPrinter(out).print(s);
  return out;
}

}  // namespace ir

std::ostream& operator<<(std::ostream& out, const Type& type) { return out << to_string(type); }
std::ostream& operator<<(std::ostream& out, const Expr& e) { return out << ir::print(e); }
std::ostream& operator<<(std::ostream& out, const Stmt& s) { return out << ir::print(s); }

}  // namespace retrograde
