#include "graph/text/binder.h"

#include <algorithm>
#include <utility>

#include "diagnostics/error.h"
#include "graph/directives/directive_fields.h"
#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/lexer.h"
#include "ir/parse.h"
#include "ir/visit.h"

namespace retrograde::graph {

namespace {

[[noreturn]] void unknown(const char* what, const std::string& name) {
  user_error("read the text of a graph", "every Func and image that is read belongs to the graph",
             text("no ", what, " of it is called ", quoted(name)),
             "Add its lines, or correct the name");
}

// Blames the first call in the text of a Func or an image that does not exist.
void check_names(const std::string& text, const NamedEntities& names) {
  ir::Lexer lexer(text);
  ir::Token before, token = lexer.next();
  while (token.kind != ir::Token::Kind::End) {
    const ir::Token after = lexer.next();
    const bool is_name =
        token.kind == ir::Token::Kind::Name && (token.quoted || !is_reserved(token.text));
    if (is_name && after.text == "(" && before.text != "extern") {
      const bool is_image = before.text == "image";
      if (is_image && !names.parameters.contains(token.text)) unknown("image", token.text);
      if (!is_image && !names.funcs.contains(token.text)) unknown("Func", token.text);
    }
    before = std::exchange(token, after);
  }
}

}  // namespace

Expr parse_with_names(const std::string& text, const NameTypes& types, const NamedEntities& names) {
  try {
    return ir::parse_expr(text, types);
  } catch (const UserError&) {
    check_names(text, names);
    throw;
  }
}

ParameterPtr NamedEntities::buffer_of_metadata(const std::string& name) const {
  const auto parsed = ir::parse_metadata_name(name);
  if (!parsed) return nullptr;
  if (const auto* found = find_or_null(parameters, parsed->buffer)) return *found;
  return value_or(outputs, parsed->buffer, nullptr);
}

Expr Binder::operator()(const Expr& root) const {
  return rewrite(root, [&](const Expr& e, const auto& recurse) {
    const Expr mapped = map_children(e, recurse);
    if (const Call* call = mapped.as<Call>()) return bound(*call, mapped);
    const Variable* v = mapped.as<Variable>();
    const SymbolRef symbol = v ? symbol_of(v->name) : SymbolRef();
    return symbol.defined() ? variable(v->name, v->type, symbol) : mapped;
  });
}

void Binder::operator()(Directive& directive) const {
  visit_names(directive, [&](Expr& e) {
    if (e.defined()) e = (*this)(e);
  });
  auto* prefetch = std::get_if<PrefetchData>(&directive);
  if (!prefetch) return;
  if (const auto f = names_.funcs.find(prefetch->source); f != names_.funcs.end())
    prefetch->symbol = SymbolRef::weak(f->second->shared_from_this());
  if (const auto p = names_.parameters.find(prefetch->source); p != names_.parameters.end())
    prefetch->symbol = SymbolRef(p->second);
}

Expr Binder::bound(const Call& call, const Expr& e) const {
  if (call.call_type == CallType::Func) {
    const auto found = names_.funcs.find(call.name);
    if (found == names_.funcs.end()) unknown("Func", call.name);
    const FuncPtr& callee = found->second;
    const SymbolRef symbol =
        owns_me(*callee) ? SymbolRef::weak(callee->shared_from_this()) : SymbolRef(callee);
    return call_func(call.name, call.type, call.args, call.component, symbol);
  }
  if (call.call_type != CallType::Image) return e;
  const auto found = names_.parameters.find(call.name);
  if (found == names_.parameters.end()) unknown("image", call.name);
  const SymbolRef symbol =
      f_ && found->second->func == f_ ? SymbolRef::weak(found->second) : SymbolRef(found->second);
  return call_image(call.name, call.type, call.args, symbol);
}

// A Func owns its definitions and its wrappers, so they must not own it.
bool Binder::owns_me(const FuncContents& callee) const {
  if (&callee == f_.get()) return true;
  return std::ranges::any_of(callee.wrappers, [&](const auto& w) { return w.second == f_; });
}

SymbolRef Binder::symbol_of(const std::string& name) const {
  if (domain_) {
    for (const ReductionVariable& v : domain_->vars) {
      if (v.var == name) return SymbolRef(domain_);
    }
  }
  if (f_ && std::ranges::find(f_->args, name) != f_->args.end()) return {};
  if (const auto found = names_.parameters.find(name); found != names_.parameters.end())
    return SymbolRef(found->second);
  const ParameterPtr buffer = names_.buffer_of_metadata(name);
  return buffer ? SymbolRef(buffer) : SymbolRef();
}

void declare(const FuncContents& f, NameTypes& types) { types.declare_components(f.name, f.types); }

void declare(const ParameterContents& parameter, NameTypes& types) {
  types.declare(parameter.is_buffer ? NameUse::Call : NameUse::Variable, parameter.name,
                parameter.type);
}

}  // namespace retrograde::graph
