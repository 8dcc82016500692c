#include "lower/instrumentation/loop_nest_text.h"

#include <algorithm>
#include <sstream>
#include <unordered_map>

#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/text.h"
#include "ir/visit.h"
#include "lower/definitions/inline_functions.h"
#include "lower/lower.h"
#include "lower/nests/build_loop_nests.h"
#include "simplify/simplify.h"

namespace retrograde::lower {
namespace {

const char* keyword(ForType type) { return type == ForType::Serial ? "for" : for_name(type); }

// Shows names as users wrote them, without the numbers that make them unique ("f$1_in_g$2"). The variables of
// vectorize(x, 8) and similar directives have no other name, so "v$3" is shown as "v3".
std::string shown(const std::string& name) {
  if (name.compare(0, 2, "v$") == 0) return "v" + name.substr(2);
  std::string result;
  bool is_number = false;
  for (const char c : name) {
    is_number = c == '$' || (is_number && c >= '0' && c <= '9');
    if (!is_number) result += c;
  }
  return result;
}

// Shows where loops come from: after split(x, xo, xi, 8) they are "x.xo" and "x.xi", after fuse(x, y, t) "x.t". A
// reduction variable is shown by the name of its domain.
class LoopNames {
 public:
  explicit LoopNames(const Program& program) {
    for (const LoopedFunc& f : program.funcs) {
      for (size_t s = 0; s < f.stages.size(); s++)
        add(stage_prefix(f.name(), static_cast<int>(s)), f.stages[s].schedule);
    }
  }
  std::string operator()(const std::string& loop) const {
    const auto found = names_.find(loop);
    return found == names_.end() ? shown(loop) : found->second;
  }

 private:
  std::unordered_map<std::string, std::string> names_;

  // Call for the general schedule first; specializations then add the loops that only they have.
  void add(const std::string& prefix, const StageLoops& schedule) {
    std::unordered_map<std::string, std::string> paths;
    const auto own = [](const std::string& var) { return shown(var.substr(0, var.find('.'))); };
    const auto path = [&](const std::string& var) {
      const auto found = paths.find(var);
      return found != paths.end() ? found->second : own(var);
    };
    for (const Split& split : schedule.splits) {
      const std::string from = path(split.kind == Split::Kind::Fuse ? split.inner : split.old_var);
      switch (split.kind) {
        case Split::Kind::Fuse:
          paths[split.old_var] = from + "." + own(split.old_var);
          break;
        case Split::Kind::Split:
          paths[split.outer] = from + "." + own(split.outer);
          paths[split.inner] = from + "." + own(split.inner);
          break;
        case Split::Kind::Rename: {
          // A variable introduced by rfactor takes the name of the reduction variable that it replaces.
          const bool is_rvar = split.outer.find('.') != std::string::npos;
          paths[split.outer] = is_rvar ? own(split.outer) : from + "." + own(split.outer);
        }
      }
    }
    for (const Dim& dim : schedule.dims) names_.emplace(prefix + dim.var, path(dim.var));
    for (const StageLoops& special : schedule.specializations) add(prefix, special);
  }
};

bool is_over_parameters(const Expr& condition) {
  bool result = true, any = false;
  walk(condition, [&](const Variable& v) {
    any = true;
    result &= dynamic_cast<const ParameterContents*>(v.symbol.raw()) != nullptr;
  });
  return any && result;
}

// The number of distinct nodes of an expression; `most` if there are at least that many.
size_t distinct_nodes(const Expr& e, size_t most) {
  size_t count = 0;
  walk(e, [&](const Expr&) { return ++count < most; });
  return std::min(count, most);
}

class LoopNestPrinter {
 public:
  explicit LoopNestPrinter(const Program& program) : program_(program), names_(program) {}
  // Records the value of a name in the nest. Bounds that recursively depend on each other, like those of a pyramid,
  // become large when expanded and never become constant: such names are not expanded.
  void bind(const std::string& name, const Expr& value) {
    const Expr known = value_of(value);
    if (distinct_nodes(known, most_nodes) < most_nodes) values_[name] = known;
  }
  std::string print(const Stmt& s) {
    visit(s);
    return out_.str();
  }

 private:
  static constexpr size_t most_nodes = 64;
  Expr value_of(const Expr& e) const { return simplify(substitute(e, values_)); }

  const Program& program_;
  const LoopNames names_;
  Substitution values_;  // of lets around the current statement
  std::ostringstream out_;
  int depth_ = 0;

  bool is_stored_further_out(const std::string& name) const {
    const LoopedFunc* f = program_.find(name);
    return f && !is_stored_where_computed(*f);
  }

  std::ostream& line() { return out_ << std::string(2 * depth_, ' '); }
  void nested(const Stmt& s) {
    depth_++;
    visit(s);
    depth_--;
  }
  // Shows the conditions of specialize; conditions of tails and of where() count as part of the body.
  void visit_branch(const IfThenElse& branch) {
    if (!is_over_parameters(branch.condition)) {
      visit(branch.when_true);
      if (branch.when_false.defined()) visit(branch.when_false);
      return;
    }
    line() << "if " << branch.condition << ":\n";
    nested(branch.when_true);
    if (!branch.when_false.defined()) return;
    line() << "else:\n";
    nested(branch.when_false);
  }
  // Shows Funcs stored at one level, producers first.
  void visit_storage(const Stmt& s) {
    std::vector<std::string> names;
    Stmt body = s;
    for (const Realize* r = body.as<Realize>(); r; r = body.as<Realize>()) {
      if (is_stored_further_out(r->name)) names.push_back(r->name);
      body = r->body;
    }
    std::sort(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
      return program_.index_of.at(a) < program_.index_of.at(b);
    });
    for (const std::string& name : names) {
      line() << "store " << shown(name) << ":\n";
      depth_++;
    }
    visit(body);
    depth_ -= static_cast<int>(names.size());
  }
  // A loop of one iteration is not shown.
  void visit_loop(const For& loop) {
    const auto constant = [&](const Expr& e) { return as_const_int(value_of(e)); };
    const auto min = constant(loop.min), extent = constant(loop.extent);
    if (extent && *extent == 1) {
      bind(loop.name, loop.min);
      return visit(loop.body);
    }
    line() << keyword(loop.runs) << ' ' << names_(loop.name);
    if (min && extent) out_ << " in [" << *min << ", " << *min + *extent - 1 << "]";
    out_ << ":\n";
    nested(loop.body);
  }
  void visit(const Stmt& s) {
    match(
        s,
        [&](const ProducerConsumer& p) {
          line() << (p.produces ? "produce " : "consume ") << shown(p.name) << ":\n";
          nested(p.body);
        },
        [&](const For& loop) { visit_loop(loop); },
        [&](const LetStmt& let) {
          bind(let.name, let.value);
          visit(let.body);
        },
        [&](const Provide& p) { line() << shown(p.name) << "(...) = ...\n"; },
        [&](const Realize&) { visit_storage(s); },
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

std::string loop_nest_text(const Program& program) {
  std::string result;
  run_on_large_stack([&] { result = LoopNestPrinter(program).print(build_loop_nests(program)); });
  return result;
}

std::string loop_nest_text(const std::vector<FuncPtr>& outputs) {
  Program program;
  run_on_large_stack([&] { program = inline_functions(outputs); });
  return loop_nest_text(program);
}

}  // namespace retrograde::lower
