// IR text.
//
// Expressions
//   3  2.5f  7_u8  1.5_f64  true  nan_f32  "text"    immediates: int32, float32, others by suffix
//   x  y:float32  `odd name`                         variables: int32 unless said
//   (a + b)  min(a, b)  !c  select(c, a, b)
//   float32x8(v)  reinterpret<int32>(v)
//   ramp(b, s, 8)  broadcast(v, 8)  shuffle(u, v; 0, 2, 1)  reduce(add, v, 1)
//   a[i]:float32x8  a[i if p]:float32                loads
//   floor(v)  abs<uint32>(v)                         operators; <type> unless the first argument's
//   f(x, y).1:float32  image in(x, y):uint8  extern hypotf(x, y):float32
//   (let t = v in body)
//   {#0 = v; #1 = w; body}                           nodes that a large expression uses repeatedly
// Statements
//   let t = v                                        its body is the rest of the block
//   assert(c, e)  free a  evaluate v  a[i if p] = v  f(x, y if p) = {u, v}
//   produce f {..}  consume f {..}  if (c) {..} else {..}  {..}
//   for (x, min, extent) {..}                        serial, or with parallel, vectorized, unrolled
//   realize f(float32, int8) auto [min, extent], [min, extent] {..}
//   allocate a[elements]:float32 heap {..}
#include "ir/print.h"

#include <charconv>
#include <cmath>
#include <ostream>
#include <unordered_map>

#include "ir/text.h"
#include "ir/visit.h"

namespace retrograde {

namespace ir {

namespace {

// The short names of types in suffixes: i8 u16 f64 bf16.
std::string suffix(Type type) {
  static constexpr const char* prefixes[] = {"i", "u", "f", "bf", "h"};
  return prefixes[static_cast<int>(type.code())] + std::to_string(type.bits());
}

std::string float_digits(Type type, double value) {
  char buffer[64];
  const auto end = type == Float(32)
                       ? std::to_chars(buffer, buffer + sizeof buffer, static_cast<float>(value))
                       : std::to_chars(buffer, buffer + sizeof buffer, value);
  return std::string(buffer, end.ptr);
}

std::string float_text(Type type, double value) {
  if (std::isnan(value)) return "nan_" + suffix(type);
  if (std::isinf(value)) return (value < 0 ? "-inf_" : "inf_") + suffix(type);
  return float_digits(type, value) + (type == Float(32) ? "f" : "_" + suffix(type));
}

std::string string_text(const std::string& value) {
  std::string out = "\"";
  for (char c : value) {
    if (c == '"' || c == '\\') out += '\\';
    if (c == '\n') {
      out += "\\n";
    } else {
      out += c;
    }
  }
  return out + '"';
}

const char* infix(Kind kind) {
  switch (kind) {
    case Kind::Add:
      return "+";
    case Kind::Sub:
      return "-";
    case Kind::Mul:
      return "*";
    case Kind::Div:
      return "/";
    case Kind::Mod:
      return "%";
    case Kind::EQ:
      return "==";
    case Kind::NE:
      return "!=";
    case Kind::LT:
      return "<";
    case Kind::LE:
      return "<=";
    case Kind::GT:
      return ">";
    case Kind::GE:
      return ">=";
    case Kind::And:
      return "&&";
    case Kind::Or:
      return "||";
    default:
      return nullptr;
  }
}

// Small trees are printed as trees, however shared. In a large one every node used twice gets a
// name, lest the text be exponential in the size of the DAG.
class Sharing {
 public:
  // The nodes to name, children first.
  static std::vector<Expr> find(const Expr& root) {
    Sharing sharing;
    sharing.count(root);
    std::vector<Expr> result;
    if (sharing.facts_[root.get()].tree_size <= large_tree) return result;
    for (const Expr& e : sharing.order_) {
      const Fact& fact = sharing.facts_[e.get()];
      if (fact.uses > 1 && fact.tree_size >= named_tree) result.push_back(e);
    }
    return result;
  }

 private:
  static constexpr double large_tree = 400, named_tree = 4;
  struct Fact {
    double tree_size = 1;  // a double: it may be astronomical
    int uses = 0;
  };
  void count(const Expr& e) {
    if (facts_[e.get()].uses++ > 0) return;
    double size = 1;
    for_each_child(e, [&](const Expr& child) {
      count(child);
      size += facts_[child.get()].tree_size;
    });
    facts_[e.get()].tree_size = size;
    order_.push_back(e);
  }
  std::unordered_map<const ExprNode*, Fact> facts_;
  std::vector<Expr> order_;
};

class Printer {
 public:
  explicit Printer(std::string& out) : out_(out) {}

  void print_root(const Expr& e) {
    const std::vector<Expr> named = Sharing::find(e);
    if (named.empty()) return print(e);
    out_ += '{';
    for (const Expr& shared : named) {
      const std::string name = "#" + std::to_string(names_.size());
      out_ += name + " = ";
      print(shared);
      out_ += "; ";
      names_.emplace(shared.get(), name);
    }
    print(e);
    out_ += '}';
    names_.clear();
  }
  void print(const Stmt& s);

 private:
  void print(const Expr& e) {
    if (const auto named = names_.find(e.get()); named != names_.end()) {
      out_ += named->second;
    } else {
      print_node(e);
    }
  }
  void print_node(const Expr& e);
  void print_call(const Call& n);

  void list(const std::vector<Expr>& es) {
    for (size_t i = 0; i < es.size(); ++i) {
      if (i) out_ += ", ";
      print(es[i]);
    }
  }
  void root_list(const std::vector<Expr>& es) {
    for (size_t i = 0; i < es.size(); ++i) {
      if (i) out_ += ", ";
      print_root(es[i]);
    }
  }
  void function(const std::string& name, std::initializer_list<Expr> args,
                const std::string& tail = "") {
    out_ += name + '(';
    list(args);
    out_ += tail + ')';
  }
  void type_unless_int32(Type type) {
    if (type != Int(32)) out_ += ':' + to_string(type);
  }

  // ---- statements ----
  void line_start() { out_.append(2 * indent_, ' '); }
  void body(const Stmt& s) {
    out_ += " {\n";
    ++indent_;
    if (s.defined()) print(s);
    --indent_;
    line_start();
    out_ += '}';
  }
  void store_predicate(const Expr& predicate) {
    if (!predicate.defined()) return;
    out_ += " if ";
    print_root(predicate);
  }
  void print_block(const Block& n);
  void print_realize(const Realize& n);
  void print_bounds(const std::vector<Range>& bounds);
  void print_if(const IfThenElse& n);

  std::string& out_;
  int indent_ = 0;
  std::unordered_map<const ExprNode*, std::string> names_;
};

void Printer::print_call(const Call& n) {
  if (n.call_type == CallType::Operator) {
    const bool implied = !n.args.empty() && n.args[0].type() == n.type;
    out_ += n.name + (implied ? "" : "<" + to_string(n.type) + ">") + '(';
    list(n.args);
    out_ += ')';
    return;
  }
  if (n.call_type == CallType::Image) out_ += "image ";
  if (n.call_type == CallType::Extern) out_ += "extern ";
  out_ += quote_name(n.name) + '(';
  list(n.args);
  out_ += ')';
  if (n.component) out_ += '.' + std::to_string(n.component);
  type_unless_int32(n.type);
}

void Printer::print_node(const Expr& e) {
  match(
      e,
      [&](const IntImm& n) {
        out_ += std::to_string(n.value) + (n.type == Int(32) ? "" : "_" + suffix(n.type));
      },
      [&](const UIntImm& n) {
        out_ += n.type.is_bool() ? (n.value ? "true" : "false")
                                 : std::to_string(n.value) + "_" + suffix(n.type);
      },
      [&](const FloatImm& n) { out_ += float_text(n.type, n.value); },
      [&](const StringImm& n) { out_ += string_text(n.value); },
      [&](const Variable& n) {
        out_ += quote_name(n.name);
        type_unless_int32(n.type);
      },
      [&](const Cast& n) { function(to_string(n.type), {n.value}); },
      [&](const Reinterpret& n) { function("reinterpret<" + to_string(n.type) + ">", {n.value}); },
      [&](const Binary& n) {
        if (n.kind == Kind::Min || n.kind == Kind::Max)
          return function(n.kind == Kind::Min ? "min" : "max", {n.a, n.b});
        out_ += '(';
        print(n.a);
        out_ += std::string(" ") + infix(n.kind) + ' ';
        print(n.b);
        out_ += ')';
      },
      [&](const Not& n) {
        out_ += '!';
        print(n.a);
      },
      [&](const Select& n) {
        function("select", {n.condition, n.when_true, n.when_false});
      },
      [&](const Load& n) {
        out_ += quote_name(n.name) + '[';
        print(n.index);
        if (n.predicate.defined()) {
          out_ += " if ";
          print(n.predicate);
        }
        out_ += ']';
        type_unless_int32(n.type);
      },
      [&](const Ramp& n) {
        function("ramp", {n.base, n.stride}, ", " + std::to_string(n.lanes));
      },
      [&](const Broadcast& n) { function("broadcast", {n.value}, ", " + std::to_string(n.lanes)); },
      [&](const Call& n) { print_call(n); },
      [&](const Let& n) {
        out_ += "(let " + quote_name(n.name) + " = ";
        print(n.value);
        out_ += " in ";
        print(n.body);
        out_ += ')';
      },
      [&](const Shuffle& n) {
        out_ += "shuffle(";
        list(n.vectors);
        for (size_t i = 0; i < n.indices.size(); ++i)
          out_ += (i ? ", " : "; ") + std::to_string(n.indices[i]);
        out_ += ')';
      },
      [&](const VectorReduce& n) {
        out_ += "reduce(" + reduce_name(n.op) + ", ";
        print(n.value);
        out_ += ", " + std::to_string(n.type.lanes()) + ')';
      },
      [&](const ExprNode& n) { out_ += kind_name(n.kind); });
}

// A let that is not last would swallow what follows it: it gets braces.
void Printer::print_block(const Block& n) {
  for (size_t i = 0; i < n.stmts.size(); ++i) {
    if (n.stmts[i].kind() == Kind::LetStmt && i + 1 < n.stmts.size()) {
      line_start();
      out_ += "{\n";
      ++indent_;
      print(n.stmts[i]);
      --indent_;
      line_start();
      out_ += "}\n";
    } else {
      print(n.stmts[i]);
    }
  }
}

void Printer::print_realize(const Realize& n) {
  out_ += "realize " + quote_name(n.name) + '(';
  for (size_t i = 0; i < n.types.size(); ++i) out_ += (i ? ", " : "") + to_string(n.types[i]);
  out_ += std::string(") ") + memory_name(n.memory);
  print_bounds(n.bounds);
  body(n.body);
}

void Printer::print_bounds(const std::vector<Range>& bounds) {
  for (size_t i = 0; i < bounds.size(); ++i) {
    out_ += i ? ", [" : " [";
    print_root(bounds[i].min);
    out_ += ", ";
    print_root(bounds[i].extent);
    out_ += ']';
  }
}

void Printer::print_if(const IfThenElse& n) {
  out_ += "if (";
  print_root(n.condition);
  out_ += ')';
  body(n.when_true);
  if (!n.when_false.defined()) return;
  out_ += " else";
  body(n.when_false);
}

void Printer::print(const Stmt& s) {
  if (const auto* block = s.as<Block>()) return print_block(*block);
  line_start();
  match(
      s,
      [&](const LetStmt& n) {
        out_ += "let " + quote_name(n.name) + " = ";
        print_root(n.value);
        out_ += '\n';
        print(n.body);
      },
      [&](const Assert& n) {
        out_ += "assert(";
        root_list({n.condition, n.error});
        out_ += ')';
      },
      [&](const ProducerConsumer& n) {
        out_ += (n.produces ? "produce " : "consume ") + quote_name(n.name);
        body(n.body);
      },
      [&](const For& n) {
        if (n.partition != Partition::Auto) out_ += std::string(partition_name(n.partition)) + ' ';
        if (n.runs != ForType::Serial) out_ += std::string(for_name(n.runs)) + ' ';
        out_ += "for (" + quote_name(n.name) + ", ";
        root_list({n.min, n.extent});
        out_ += ')';
        body(n.body);
      },
      [&](const Store& n) {
        out_ += quote_name(n.name) + '[';
        print_root(n.index);
        store_predicate(n.predicate);
        out_ += "] = ";
        print_root(n.value);
      },
      [&](const Provide& n) {
        out_ += quote_name(n.name) + '(';
        root_list(n.args);
        store_predicate(n.predicate);
        out_ += ") = {";
        root_list(n.values);
        out_ += '}';
      },
      [&](const Realize& n) { print_realize(n); },
      [&](const Allocate& n) {
        out_ += "allocate " + quote_name(n.name) + '[';
        print_root(n.elements);
        out_ += "]:" + to_string(n.type) + ' ' + memory_name(n.memory);
        body(n.body);
      },
      [&](const Free& n) { out_ += "free " + quote_name(n.name); },
      [&](const IfThenElse& n) { print_if(n); },
      [&](const Evaluate& n) {
        out_ += "evaluate ";
        print_root(n.value);
      },
      [&](const Atomic& n) {
        out_ += "atomic " + quote_name(n.name);
        body(n.body);
      },
      [&](const Fork& n) {
        out_ += "fork";
        body(n.first);
        out_ += " and";
        body(n.rest);
      },
      [&](const Prefetch& n) {
        out_ += "prefetch " + quote_name(n.name) + '(' + to_string(n.type) + ')';
        print_bounds(n.bounds);
      },
      [&](const StmtNode& n) { out_ += kind_name(n.kind); });
  if (s.kind() != Kind::LetStmt) out_ += '\n';
}

}  // namespace

std::string PrintFunction::operator()(const Expr& e) const {
  std::string out;
  if (!e.defined()) return "<undefined>";
  Printer(out).print_root(e);
  return out;
}

std::string PrintFunction::operator()(const Stmt& s) const {
  std::string out;
  if (s.defined()) Printer(out).print(s);
  return out;
}

}  // namespace ir

std::ostream& operator<<(std::ostream& out, const Type& type) { return out << to_string(type); }
std::ostream& operator<<(std::ostream& out, const Expr& e) { return out << ir::print(e); }
std::ostream& operator<<(std::ostream& out, const Stmt& s) { return out << ir::print(s); }

}  // namespace retrograde
