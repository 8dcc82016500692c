#include "lower/bind_symbols.h"

#include "ir/visit.h"

namespace retrograde::lower {

namespace {

using Parameters = std::vector<std::shared_ptr<ParameterContents>>;

class SymbolBinder : public Rewriter {
 public:
  SymbolBinder(const Program& program, const Parameters& parameters)
      : program_(program), parameters_(parameters) {}

 protected:
  Expr rewrite(const Expr& original) override {
    const Expr e = children(original);
    if (const Variable* n = e.as<Variable>()) return variable(n->name, n->type, parameter(n->name));
    if (const Load* n = e.as<Load>())
      return make_load(n->type, n->name, n->index, n->predicate, parameter(n->name));
    const Call* n = e.as<Call>();
    if (!n) return e;
    if (n->call_type == CallType::Image)
      return call_image(n->name, n->type, n->args, parameter(n->name));
    const LoopedFunc* f = n->call_type == CallType::Func ? program_.find(n->name) : nullptr;
    return f ? call_func(n->name, n->type, n->args, n->component, SymbolRef(f->func)) : e;
  }

  Stmt rewrite(const Stmt& original) override {
    const Stmt s = children(original);
    const Prefetch* n = s.as<Prefetch>();
    return n ? make_prefetch(n->name, n->type, n->bounds, parameter(n->name)) : s;
  }

 private:
  const Program& program_;
  const Parameters& parameters_;

  SymbolRef parameter(const std::string& name) const {
    for (const auto& p : parameters_)
      if (p->name == name) return SymbolRef(p);
    return {};
  }
};

}  // namespace

Stmt bind_symbols(const Stmt& s, const Program& program, const Parameters& parameters) {
  return s.defined() ? SymbolBinder(program, parameters)(s) : s;
}

}  // namespace retrograde::lower
