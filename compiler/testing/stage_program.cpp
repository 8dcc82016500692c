// Flattening: a memoised post-order walk.
#include "testing/stage_program.h"

#include <map>

#include "diagnostics/error.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::oracle {

using ir::Op;

namespace {

class Flattener {
 public:
  Flattener(StageProgram& program, bool widen) : program_(program), widen_(widen) {}

  void add_coordinate(const std::string& name) {
    Step step;
    step.code = Step::Code::Coordinate;
    step.index = static_cast<int>(names_.size());
    step.type = step.declared = Int(32);
    names_[name] = push(std::move(step));
  }

  int flatten(const Expr& e) {
    if (auto it = memo_.find(e.get()); it != memo_.end()) return it->second;
    const int step = build(e);
    memo_[e.get()] = step;
    return step;
  }

 private:
  int push(Step step) {
    program_.steps.push_back(std::move(step));
    return static_cast<int>(program_.steps.size()) - 1;
  }

  Type widened(Type type) const { return widen_ && type.is_float() ? Float(64) : type; }

  Step start(const Expr& e, Step::Code code) const {
    Step step;
    step.code = code;
    step.kind = e.kind();
    step.declared = e.type();
    step.type = widened(e.type());
    return step;
  }

  int constant(const Expr& e) {
    Step step = start(e, Step::Code::Constant);
    step.constant.scalar = *ir::as_scalar(e);
    step.constant.scalar.type = step.type;
    return push(std::move(step));
  }

  int with_children(Step step, std::initializer_list<Expr> children) {
    for (const Expr& child : children) step.children.push_back(flatten(child));
    return push(std::move(step));
  }

  int variable(const Expr& e, const ir::Variable& v) {
    if (auto it = names_.find(v.name); it != names_.end()) return it->second;
    auto* parameter = dynamic_cast<ir::ParameterContents*>(v.symbol.raw());
    if (!parameter) internal_error("unbound variable " + quoted(v.name));
    Step step = start(e, parameter->is_buffer ? Step::Code::BufferFact : Step::Code::Parameter);
    step.symbol = parameter;
    step.name = v.name;
    return push(std::move(step));
  }

  int let(const ir::Let& let) {
    const int value = flatten(let.value);
    names_[let.name] = value;  // names are unique: nothing to restore
    return flatten(let.body);
  }

  static Step::Code code_of(Op op) {
    switch (op) {
      case Op::undef:
        return Step::Code::Undef;
      case Op::random:
        return Step::Code::Random;
      case Op::require:
        return Step::Code::Require;
      case Op::if_then_else:  // what is not chosen is not evaluated
        return Step::Code::Select;
      case Op::print:
      case Op::print_when:
        return Step::Code::Print;
      default:
        return Step::Code::Operator;
    }
  }

  int call(const Expr& e, const ir::Call& call) {
    Step step = start(e, Step::Code::Operator);
    switch (call.call_type) {
      case ir::CallType::Operator:
        step.code = code_of(call.op);
        step.index = call.op == Op::print_when ? 1 : 0;
        break;
      case ir::CallType::Func:
        step.code = Step::Code::FuncCall;
        break;
      case ir::CallType::Image:
        step.code = Step::Code::ImageCall;
        break;
      case ir::CallType::Extern:
        step.code = Step::Code::ExternCall;
        break;
    }
    step.op = call.op;
    step.name = call.name;
    step.symbol = call.symbol.raw();
    if (step.code == Step::Code::FuncCall || step.code == Step::Code::ImageCall) {
      step.index = call.component;
    }
    for (const Expr& arg : call.args) step.children.push_back(flatten(arg));
    return push(std::move(step));
  }

  int text(const Expr& e) {
    Step step = start(e, Step::Code::Text);
    step.name = e.as<ir::StringImm>()->value;
    return push(std::move(step));
  }

  int build(const Expr& e) {
    if (e.type().is_vector()) internal_error("the interpreter met a vector: " + ir::print(e));
    return ir::match(
        e, [&](const ir::IntImm&) { return constant(e); },
        [&](const ir::UIntImm&) { return constant(e); },
        [&](const ir::FloatImm&) { return constant(e); },
        [&](const ir::StringImm&) { return text(e); },
        [&](const ir::Variable& v) { return variable(e, v); },
        [&](const ir::Cast& n) { return with_children(start(e, Step::Code::Cast), {n.value}); },
        [&](const ir::Reinterpret& n) {
          return with_children(start(e, Step::Code::Reinterpret), {n.value});
        },
        [&](const ir::Binary& n) {
          return with_children(start(e, Step::Code::Binary), {n.a, n.b});
        },
        [&](const ir::Not& n) { return with_children(start(e, Step::Code::Not), {n.a}); },
        [&](const ir::Select& n) {
          return with_children(start(e, Step::Code::Select),
                               {n.condition, n.when_true, n.when_false});
        },
        [&](const ir::Call& n) { return call(e, n); }, [&](const ir::Let& n) { return let(n); },
        [&](const ir::ExprNode&) -> int {
          internal_error("not part of an algorithm: " + ir::print(e));
        });
  }

  StageProgram& program_;
  const bool widen_;
  std::map<std::string, int> names_;
  std::unordered_map<const ir::ExprNode*, int> memo_;
};

bool is_variable(const Expr& e, const std::string& name) {
  const auto* v = e.as<ir::Variable>();
  return v && v->name == name;
}

}  // namespace

StageProgram flatten_stage(const ir::FuncContents& func, int stage, bool widen) {
  const ir::Definition& definition = func.stage(stage);
  StageProgram program;
  Flattener flattener(program, widen);
  for (const std::string& arg : func.args) flattener.add_coordinate(arg);
  for (const auto& rvar : definition.rvars) flattener.add_coordinate(rvar.var);
  for (const auto& rvar : definition.rvars) {
    const int min = flattener.flatten(rvar.min);
    program.rvars.push_back({min, flattener.flatten(rvar.extent)});
  }
  for (size_t d = 0; d < definition.args.size(); ++d) {
    program.args.push_back(flattener.flatten(definition.args[d]));
    program.is_pure_arg.push_back(is_variable(definition.args[d], func.args[d]));
  }
  for (const Expr& value : definition.values) program.values.push_back(flattener.flatten(value));
  if (definition.predicate.defined()) {
    program.predicate = flattener.flatten(definition.predicate);
  }
  return program;
}

}  // namespace retrograde::oracle
