// Prints the expressions of IR text.
//
// Expressions
//   3  2.5f  7_u8  1.5_f64  true  nan_f32  "text"    immediates: int32, float32, others by suffix
//   x  y:float32  `odd name`                         variables
//   a + b * c  min(a, b)  !c  select(c, a, b)        C's precedence, no redundant parentheses
//   float32x8(v)  reinterpret<int32>(v)              casts
//   ramp(b, s, 8)  broadcast(v, 8)  shuffle(u, v; 0, 2, 1)  reduce(add, v, 1)
//   a[i]:float32  a[i if p]:float32                  loads
//   floor(v)  abs<uint32>(v)                         operators; <type> unless the first argument's
//   f(x, y).1:float32  image in(x, y):uint8  extern hypotf(x, y):float32
//   (let t = v in body)
//   {#0 = v; #1 = w; body}                           nodes that a large expression uses repeatedly
// The type after a colon is omitted where it is known: from the name's declaration (let, for, allocate, realize),
// otherwise from its first store or mention. A first mention without a type means int32. A load has the lanes of its
// index and a call those of its arguments, unless a type is written.
#include "ir/print_expr.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <unordered_map>

#include "diagnostics/error.h"
#include "ir/visit.h"

namespace retrograde::ir {

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

// Small expressions are printed as trees even when nodes are shared. In a large one every node that
// is used twice gets a name; otherwise the text could be exponential in the size of the DAG.
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
    double tree_size = 1;  // a double, because it may be astronomical
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

bool is_comparison(Kind kind) {
  const InfixOperator* op = infix_operator(kind);
  return op->precedence > infix_operator(Kind::And)->precedence && op->precedence < sum_precedence;
}

// Appends text and expressions in turn.
class ExprPrinter {
 public:
  ExprPrinter(std::string& out, NameTypes& types) : out_(out), types_(types) {}

  void print_root(const Expr& e) {
    const std::vector<Expr> named = Sharing::find(e);
    if (named.empty()) return put(e);
    put("{");
    for (const Expr& shared : named) {
      const std::string name = "#" + std::to_string(names_.size());
      write(name, " = ", shared, "; ");
      names_.emplace(shared.get(), name);
    }
    write(e, "}");
    names_.clear();
  }

 private:
  void put(const char* text) { out_ += text; }
  void put(const std::string& text) { out_ += text; }
  void put(const std::vector<Expr>& list) {
    for (size_t i = 0; i < list.size(); ++i) write(i ? ", " : "", list[i]);
  }
  void put(const Expr& e) {
    if (const auto named = names_.find(e.get()); named != names_.end()) {
      put(named->second);
    } else {
      print_node(e);
    }
  }
  void put_type(NameUse use, const std::string& name, int lanes, Type type, int component = 0) {
    const bool is_implied = types_.implied(use, name, lanes, component) == type;
    types_.mention(use, name, use == NameUse::Variable ? type : type.element_of(), component);
    if (!is_implied) put(':' + to_string(type));
  }
  // An operand that is parenthesised if it binds less tightly than `precedence`.
  struct Operand {
    const Expr& e;
    int precedence;
  };
  void put(Operand operand) {
    const InfixOperator* op =
        names_.count(operand.e.get()) ? nullptr : infix_operator(operand.e.kind());
    if (op && op->precedence < operand.precedence) {
      write("(", operand.e, ")");
    } else {
      put(operand.e);
    }
  }
  template <class... Parts>
  void write(const Parts&... parts) {
    (put(parts), ...);
  }
  void print_node(const Expr& e) {
    match(
        e,
        [&](const IntImm& n) {
          write(std::to_string(n.value), n.type == Int(32) ? "" : "_" + suffix(n.type));
        },
        [&](const UIntImm& n) {
          put(n.type.is_bool() ? (n.value ? "true" : "false")
                               : std::to_string(n.value) + "_" + suffix(n.type));
        },
        [&](const FloatImm& n) { put(float_text(n.type, n.value)); },
        [&](const StringImm& n) { put(string_text(n.value)); },
        [&](const Variable& n) {
          put(quote_name(n.name));
          put_type(NameUse::Variable, n.name, n.type.lanes(), n.type);
        },
        [&](const Cast& n) { write(to_string(n.type), "(", n.value, ")"); },
        [&](const Reinterpret& n) { write("reinterpret<", to_string(n.type), ">(", n.value, ")"); },
        [&](const Binary& n) { print_binary(n); },
        [&](const Not& n) {
          write("!", Operand{n.a, prefix_precedence});
        },
        [&](const Select& n) {
          write("select(", n.condition, ", ", n.when_true, ", ", n.when_false, ")");
        },
        [&](const Load& n) {
          write(quote_name(n.name), "[", n.index);
          if (n.predicate.defined()) write(" if ", n.predicate);
          put("]");
          put_type(NameUse::Buffer, n.name, n.index.type().lanes(), n.type);
        },
        [&](const Ramp& n) {
          write("ramp(", n.base, ", ", n.stride, ", ", std::to_string(n.lanes), ")");
        },
        [&](const Broadcast& n) {
          write("broadcast(", n.value, ", ", std::to_string(n.lanes), ")");
        },
        [&](const Call& n) { print_call(n); },
        [&](const Let& n) {
          write("(let ", quote_name(n.name), " = ", n.value, " in ");
          types_.declare(NameUse::Variable, n.name, n.value.type());
          write(n.body, ")");
        },
        [&](const Shuffle& n) {
          write("shuffle(", n.vectors, "; ",
                listed(n.indices, [](int i) { return std::to_string(i); }), ")");
        },
        [&](const VectorReduce& n) {
          write("reduce(", kind_word(n.op), ", ", n.value, ", ", std::to_string(n.type.lanes()),
                ")");
        },
        [&](const ExprNode& n) { put(kind_name(n.kind)); });
  }
  void print_binary(const Binary& n) {
    const InfixOperator* op = infix_operator(n.kind);
    if (!op) return write(kind_word(n.kind), "(", n.a, ", ", n.b, ")");
    // Parentheses around a comparison of comparisons help readers; the parser needs none.
    const int left = is_comparison(n.kind) ? sum_precedence : op->precedence;
    write(Operand{n.a, left}, " ", op->symbol, " ",
          Operand{n.b, std::max(left, op->precedence + 1)});
  }
  void print_call(const Call& n) {
    if (n.call_type == CallType::Operator) {
      const bool implied = !n.args.empty() && n.args[0].type() == n.type;
      return write(n.name, implied ? "" : "<" + to_string(n.type) + ">", "(", n.args, ")");
    }
    if (n.call_type == CallType::Image) put("image ");
    if (n.call_type == CallType::Extern) put("extern ");
    write(quote_name(n.name), "(", n.args, ")");
    if (n.component) put('.' + std::to_string(n.component));
    put_type(NameUse::Call, n.name, lanes_of(n.args), n.type, n.component);
  }

  std::string& out_;
  NameTypes& types_;
  std::unordered_map<const ExprNode*, std::string> names_;
};

}  // namespace

void print_expr(const Expr& e, NameTypes& types, std::string& out) {
  ExprPrinter(out, types).print_root(e);
}

}  // namespace retrograde::ir
