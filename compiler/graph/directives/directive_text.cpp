// Arguments are parsed as expressions, in which names and enumerators appear as variables.
#include "graph/directives/directive_text.h"

#include "diagnostics/error.h"
#include "graph/directives/directive_choices.h"
#include "graph/directives/directive_fields.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/parse.h"
#include "ir/print.h"
#include "ir/text.h"

namespace retrograde::graph {

namespace {

// ---- printing ----

std::string print_field(const std::string& name) { return quote_name(name); }
std::string print_field(const Expr& e) { return print_argument(e); }
std::string print_field(bool flag) { return flag ? "true" : "false"; }
template <Enumeration E>
std::string print_field(E value) {
  return choice_name(value);
}
std::string print_field(const LoopLevel& level) {
  if (level.kind == LoopLevel::Kind::Inlined) return "inlined";
  if (level.kind == LoopLevel::Kind::Root) return "root";
  const std::string stage = level.stage < 0 ? "" : text(", ", level.stage);
  return text("loop(", quote_name(level.func), ", ", quote_name(level.var), stage, ")");
}

// ---- parsing ----

class Reader {
 public:
  Reader(std::string line, std::vector<Expr> args)
      : line_(std::move(line)), args_(std::move(args)) {}

  template <typename D>
  D read() {
    D directive;
    const auto read_field = [&](auto& field) { read(field); };
    const auto has_more = [&] { return next_ < args_.size(); };
    FieldVisitor{read_field, has_more}.fields_of(directive);
    if (next_ != args_.size()) fail("fewer arguments");
    return directive;
  }

 private:
  [[noreturn]] void fail(const std::string& expected) const {
    user_error("read the directive " + line_, "its arguments are those of directive.h",
               text("argument ", next_, " should be ", expected), "Write it as to_text() does");
  }
  const Expr& take(const char* expected) {
    if (next_ == args_.size()) fail(expected);
    return args_[next_++];
  }
  std::string name_of(const Expr& e, const char* expected) const {
    const Variable* v = e.defined() ? e.as<Variable>() : nullptr;
    if (!v) fail(expected);
    return v->name;
  }

  void read(std::string& name) { name = name_of(take("a name"), "a name"); }
  void read(Expr& e) { e = take("an expression"); }
  void read(bool& flag) {
    const Expr& e = take("true or false");
    const UIntImm* value = e.defined() ? e.as<UIntImm>() : nullptr;
    if (!value) fail("true or false");
    flag = value->value != 0;
  }
  template <Enumeration E>
  void read(E& value) {
    const std::string word = name_of(take("a choice"), "a choice");
    const auto& names = Choices<E>::names;
    for (size_t i = 0; i < names.size(); ++i) {
      if (word == names[i]) {
        value = static_cast<E>(i);
        return;
      }
    }
    fail("one of the choices that the directive has");
  }
  void read(LoopLevel& level) {
    const Expr& e = take("a loop level");
    if (const Call* call = e.defined() ? e.as<Call>() : nullptr;
        call && call->name == "loop" && call->args.size() >= 2) {
      level = {
          LoopLevel::Kind::At, name_of(call->args[0], "a Func"), name_of(call->args[1], "a loop"),
          call->args.size() > 2 ? static_cast<int>(as_const_int(call->args[2]).value_or(-1)) : -1};
      return;
    }
    const std::string word = name_of(e, "root, inlined or loop(f, x)");
    level.kind = word == "root" ? LoopLevel::Kind::Root : LoopLevel::Kind::Inlined;
  }

  std::string line_;
  std::vector<Expr> args_;
  size_t next_ = 0;
};

template <size_t I = 0>
std::optional<Directive> parse_from(const std::string& line) {
  if constexpr (I == std::variant_size_v<Directive>) {
    return std::nullopt;
  } else {
    using D = std::variant_alternative_t<I, Directive>;
    if (line.substr(0, line.find('(')) != D::name) return parse_from<I + 1>(line);
    return Reader(line, parse_arguments(line)).template read<D>();
  }
}

// ---- comparing ----

bool same(const Expr& a, const Expr& b) {
  return a.defined() == b.defined() && (!a.defined() || equal(a, b));
}
template <typename T>
bool same(const T& a, const T& b) {
  return a == b;
}

}  // namespace

std::string print_argument(const Expr& e) { return e.defined() ? print(e) : "_"; }

std::vector<Expr> parse_arguments(const std::string& line, const NameTypes& declared) {
  const size_t open = line.find('(');
  const Expr all =
      parse_expr("arguments" + (open == std::string::npos ? "()" : line.substr(open)), declared);
  std::vector<Expr> args = all.as<Call>()->args;
  for (Expr& arg : args) {
    const Variable* v = arg.as<Variable>();
    if (v && v->name == "_") arg = Expr();
  }
  return args;
}

std::string to_text(const Directive& directive) {
  return std::visit(
      [](auto d) {
        std::vector<std::string> fields;
        visit_fields(d, [&](const auto& field) { fields.push_back(print_field(field)); });
        return text(d.name, "(", listed(fields), ")");
      },
      directive);
}

std::optional<Directive> parse_directive(const std::string& line) { return parse_from(line); }

bool equal(const Directive& a, const Directive& b) {
  if (a.index() != b.index()) return false;
  return std::visit(
      [&](auto x) {
        auto y = std::get<decltype(x)>(b);
        const auto xs = x.fields(), ys = y.fields();
        return [&]<size_t... i>(std::index_sequence<i...>) {
          return (same(std::get<i>(xs), std::get<i>(ys)) && ...);
        }
        (std::make_index_sequence<std::tuple_size_v<decltype(x.fields())>>());
      },
      a);
}

}  // namespace retrograde::graph
