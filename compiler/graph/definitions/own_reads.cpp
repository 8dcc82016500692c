#include "graph/definitions/own_reads.h"

#include <algorithm>

#include "ir/equal.h"
#include "ir/walk_once.h"

namespace retrograde::graph {

bool is_call_of(const Call& call, const Symbol* f) {
  return call.call_type == CallType::Func && call.symbol.raw() == f;
}

const Call* as_call_of(const Expr& e, const Symbol* f) {
  const auto* call = e.as<Call>();
  return call && is_call_of(*call, f) ? call : nullptr;
}

Expr map_func_calls(const Expr& e, MapCall read) {
  return rewrite(e, [&](const Expr& node, const auto& recurse) -> Expr {
    const auto* call = node.as<Call>();
    if (!call || call->call_type != CallType::Func) return {};
    const std::vector<Expr> args = mapped(call->args, recurse);
    return read(*call, args);
  });
}

Expr map_calls_of(const Expr& e, const Symbol* f, MapCall read) {
  return map_func_calls(e, [&](const Call& call, const std::vector<Expr>& args) {
    return call.symbol.raw() == f ? read(call, args) : Expr();
  });
}

bool same_args(const std::vector<Expr>& a, const std::vector<Expr>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Expr& x, const Expr& y) { return equal(x, y); });
}

void walk_definition(const Definition& definition, FunctionRef<void(const Expr&)> visit) {
  NodeSet visited;
  for_each_expr(definition, [&](const Expr& root) {
    walk_once(root, visited, [&](const Expr& e) {
      visit(e);
      return true;
    });
  });
}

std::vector<Expr> own_reads(const FuncContents& f, const Definition& update) {
  std::vector<Expr> reads;
  walk_definition(update, [&](const Expr& e) {
    if (as_call_of(e, &f)) reads.push_back(e);
  });
  return reads;
}

bool is_pure_position(const FuncContents& f, const Definition& definition, size_t d) {
  const auto* v = definition.args[d].as<Variable>();
  return v && !v->symbol.defined() && v->name == f.args[d];
}

bool is_old_value(const Expr& e, const FuncContents& f, const Definition& update, int k) {
  const Call* call = as_call_of(e, &f);
  return call && (k < 0 || call->component == k) && same_args(call->args, update.args);
}

Expr read_elsewhere(const FuncContents& f, const Definition& update) {
  for (const Expr& read : own_reads(f, update)) {
    if (!is_old_value(read, f, update)) return read;
  }
  return {};
}

}  // namespace retrograde::graph
