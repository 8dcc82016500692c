// The loop nest of a pipeline as a user schedules it: one line a loop, producers marked.
#include <sstream>

#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "lower/build_loop_nests.h"
#include "lower/inline_functions.h"
#include "lower/lower.h"

namespace retrograde::ir {
namespace {

const char* keyword(ForType type) {
  switch (type) {
    case ForType::Serial:
      return "for";
    case ForType::Parallel:
      return "parallel";
    case ForType::Vectorized:
      return "vectorized";
    case ForType::Unrolled:
      return "unrolled";
  }
  internal_error("a loop of no type");
}

// "f.s0.xo" -> "xo". A Func's own name may contain dots, a variable's may not start a stage.
std::string user_name(const std::string& loop) {
  size_t stage = loop.find(".s");
  size_t dot = stage == std::string::npos ? std::string::npos : loop.find('.', stage + 2);
  return dot == std::string::npos ? loop : loop.substr(dot + 1);
}

bool is_over_parameters(const Expr& condition) {
  bool result = true, any = false;
  walk(condition, [&](const Expr& e) {
    const Variable* v = e.as<Variable>();
    if (!v) return true;
    any = true;
    result &= dynamic_cast<const ParameterContents*>(v->symbol.raw()) != nullptr;
    return true;
  });
  return any && result;
}

class LoopNestPrinter {
 public:
  explicit LoopNestPrinter(const Program& program) : program_(program) {}
  std::string print(const Stmt& s) {
    visit(s);
    return out_.str();
  }

 private:
  const Program& program_;
  std::ostringstream out_;
  int depth_ = 0;

  bool is_stored_further_out(const std::string& name) const {
    const LoopedFunc* f = program_.find(name);
    return f && f->schedule.store_level.kind != LoopLevel::Kind::Inlined &&
           !(f->schedule.store_level == f->schedule.compute_level);
  }

  std::ostream& line() { return out_ << std::string(2 * depth_, ' '); }
  void nested(const Stmt& s) {
    depth_++;
    visit(s);
    depth_--;
  }
  // Conditions of specialize are shown; those of tails and of where() belong to the body.
  void visit_branch(const IfThenElse& branch) {
    if (!is_over_parameters(branch.condition)) {
      visit(branch.then_case);
      if (branch.else_case.defined()) visit(branch.else_case);
      return;
    }
    line() << "if " << branch.condition << ":\n";
    nested(branch.then_case);
    if (!branch.else_case.defined()) return;
    line() << "else:\n";
    nested(branch.else_case);
  }
  void visit(const Stmt& s) {
    match(
        s,
        [&](const ProducerConsumer& p) {
          line() << (p.is_producer ? "produce " : "consume ") << p.name << ":\n";
          nested(p.body);
        },
        [&](const For& loop) {
          line() << keyword(loop.for_type) << ' ' << user_name(loop.name);
          auto min = as_const_int(loop.min), extent = as_const_int(loop.extent);
          if (min && extent) out_ << " in [" << *min << ", " << *min + *extent - 1 << "]";
          out_ << ":\n";
          nested(loop.body);
        },
        [&](const Provide& p) { line() << p.name << "(...) = ...\n"; },
        [&](const Realize& r) {
          if (!is_stored_further_out(r.name)) return visit(r.body);
          line() << "store " << r.name << ":\n";
          nested(r.body);
        },
        [&](const IfThenElse& branch) { visit_branch(branch); },
        [&](const Assert& a) {
          if (is_const_false(a.condition)) line() << "fail\n";
        },
        [&](const StmtNode&) {
          for_each_child(
              s, [](const Expr&) {}, [&](const Stmt& child) { visit(child); });
        });
  }
};

}  // namespace

std::string loop_nest_text(const std::vector<FuncPtr>& outputs) {
  std::string result;
  run_on_large_stack([&] {
    Program program = inline_functions(outputs);
    result = LoopNestPrinter(program).print(build_loop_nests(program, {.slide = false}).body);
  });
  return result;
}

}  // namespace retrograde::ir
