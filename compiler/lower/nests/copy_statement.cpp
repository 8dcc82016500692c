#include "lower/nests/copy_statement.h"

#include <cctype>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "lower/program.h"

namespace retrograde::lower {

namespace {

// The name without the number of a copy.

template <class Found>
void for_each_name(const Stmt& s, Found found) {
  walk(
      s,
      [&](const Expr& e) {
        if (const Variable* v = e.as<Variable>()) found(v->name);
        if (const Let* let = e.as<Let>()) found(let->name);
        if (const Load* load = e.as<Load>()) found(load->name);
        const Call* call = e.as<Call>();
        if (call && call->call_type != CallType::Operator) found(call->name);
        return true;
      },
      [&](const Stmt& node) {
        match(node, [&](const auto& n) {
          if constexpr (requires { n.name; }) found(n.name);
        });
        return true;
      });
}

// Renames all bindings. One flat map of new names suffices, since names are unique.
class Copier : public Rewriter {
 public:
  Copier(const Stmt& s, FreshNames& fresh, const Substitution& values) : values_(values) {
    walk(
        s, [&](const Let& n) { rename(n.name, fresh); },
        [&](const LetStmt& n) { rename(n.name, fresh); },
        [&](const For& n) { rename(n.name, fresh); },
        [&](const Allocate& n) { rename(n.name, fresh); },
        [&](const Realize& n) { rename(n.name, fresh); });
  }

 protected:
  Expr rewrite(const Expr& e) override {
    if (const Variable* v = e.as<Variable>()) {
      if (auto it = values_.find(v->name); it != values_.end()) return it->second;
      auto it = names_.find(v->name);
      return it == names_.end() ? e : Expr(make_node<Variable>(v->type, it->second, v->symbol));
    }
    const Expr copy = map_children(
        e, [this](const Expr& child) { return (*this)(child); },
        [this](Kind, const std::string& name) { return name_of(name); });
    const Call* n = copy.as<Call>();
    if (!n || n->call_type != CallType::Func || !names_.count(n->name)) return copy;
    return call_func(name_of(n->name), n->type, n->args, n->component, n->symbol);
  }

  Stmt rewrite(const Stmt& s) override {
    return map_children(
        s, [this](const Expr& child) { return (*this)(child); },
        [this](const Stmt& child) { return (*this)(child); },
        [this](Kind kind, const std::string& name) {
          return kind == Kind::ProducerConsumer ? name : name_of(name);
        });
  }

 private:
  void rename(const std::string& name, FreshNames& fresh) {
    auto [it, is_new] = names_.emplace(name, "");
    if (is_new) it->second = fresh(name);
  }
  std::string name_of(const std::string& name) const { return value_or(names_, name, name); }

  const Substitution& values_;
  std::unordered_map<std::string, std::string> names_;
};

}  // namespace

void FreshNames::read_program() {
  if (!program_.defined()) return;
  for_each_name(program_, [&](const std::string& name) { taken_.insert(name); });
  program_ = Stmt();
}

std::string FreshNames::operator()(const std::string& model) {
  read_program();
  std::string base = original_name(model), name;
  do {
    name = base + ".$" + std::to_string(++next_[base]);
  } while (!taken_.insert(name).second);
  return name;
}

Stmt copy_statement(const Stmt& s, FreshNames& fresh, const Substitution& values) {
  return s.defined() ? Copier(s, fresh, values)(s) : s;
}

LoopName decode_loop_name(const std::string& name) {
  std::string loop = original_name(name);
  for (size_t dot = loop.find(".s"); dot != std::string::npos; dot = loop.find(".s", dot + 1)) {
    size_t end = dot + 2;
    while (end < loop.size() && std::isdigit(static_cast<unsigned char>(loop[end]))) ++end;
    if (end > dot + 2 && end < loop.size() && loop[end] == '.') {
      return {loop.substr(0, dot), loop.substr(dot + 2, end - dot - 2), loop.substr(end + 1)};
    }
  }
  return {"", "", loop};
}

std::string describe_loop(const std::string& loop) {
  LoopName name = decode_loop_name(loop);
  if (name.func.empty()) return quoted(name.var);
  std::string text = quoted(name.var) + " of " + quoted(name.func);
  return name.stage == "0" ? text
                           : text + " (update " + std::to_string(std::stoi(name.stage) - 1) + ")";
}

}  // namespace retrograde::lower
