// Text follows apply_schedule.cpp case by case.
#include <sstream>

#include "diagnostics/error.h"
#include "testing/print_program.h"

namespace retrograde::fuzz {

namespace {

using Kind = Directive::Kind;
using Where = Placement::Where;

class SchedulePrinter {
 public:
  explicit SchedulePrinter(const ScheduleSpec& schedule)
      : schedule_(schedule),
        first_derived_(static_cast<int>(schedule.funcs.size() - schedule.derived.size())) {}

  std::string run() {
    for (size_t i = 0; i < schedule_.derived.size(); ++i) print_derived(static_cast<int>(i));
    for (int f = 0; f < count(); ++f) print_loops(f);
    for (int f = 0; f < count(); ++f) print_func(f);
    for (const Companion& c : schedule_.companions) {
      static const char* const aligns[] = {"AlignStart", "AlignEnd", "NoAlign", "Auto"};
      out_ << text("f", c.func, ".compute_with(f", c.with, ", ", c.loop,
                   ", LoopAlignStrategy::", aligns[static_cast<int>(c.align)], ");\n");
    }
    const bool specializes = out_.str().find("selector ==") != std::string::npos;
    if (specializes) {
      declarations_ << "Param<int> selector; selector.set(" << schedule_.selector << ");\n";
    }
    return declarations_.str() + out_.str();
  }

 private:
  int count() const { return static_cast<int>(schedule_.funcs.size()); }

  void declare(const std::string& name) {
    declarations_ << (is_reduction_loop(name) ? "RVar " : "Var ") << name << "(\"" << name
                  << "\");\n";
  }

  // Domains are named for the Func that declares them: a derived one has none of its own.
  std::string loop(const std::string& name, int f, int stage) const {
    if (!is_reduction_variable(name)) return name;
    if (f >= first_derived_) {
      const DerivedFunc& derived = schedule_.derived[f - first_derived_];
      stage = derived.kind == DerivedFunc::Kind::Factored ? derived.stage : stage;
      f = derived.source;
    }
    return text("r", f, "_", stage - 1, "[", name[1], "]");
  }

  void print_derived(int i) {
    const DerivedFunc& derived = schedule_.derived[i];
    const std::string name = text("f", first_derived_ + i), source = text("f", derived.source);
    const std::string user = derived.consumer < 0 ? "" : text("f", derived.consumer);
    switch (derived.kind) {
      case DerivedFunc::Kind::None:
        return;
      case DerivedFunc::Kind::Wrapper:
        out_ << "Func " << name << " = " << source << ".in(" << user << ");\n";
        return;
      case DerivedFunc::Kind::Clone:
        out_ << "Func " << name << " = " << source << ".clone_in(" << user << ");\n";
        return;
      case DerivedFunc::Kind::Factored:
        break;
    }
    const std::string update = text(source, ".update(", derived.stage - 1, ")");
    if (derived.factor > 0) {
      declare(derived.outer);
      declare(derived.inner);
      out_ << update << ".split(" << loop(derived.split_loop, derived.source, derived.stage) << ", "
           << derived.outer << ", " << derived.inner << ", " << derived.factor << ");\n";
    }
    std::vector<std::string> pairs;
    for (size_t k = 0; k < derived.preserved.size(); ++k) {
      declare(derived.variables[k]);
      pairs.push_back("{" + loop(derived.preserved[k], derived.source, derived.stage) + ", " +
                      derived.variables[k] + "}");
    }
    out_ << "Func " << name << " = " << update << ".rfactor({" << join(pairs) << "});\n";
  }

  void print_loops(int f) {
    const FuncScheduleSpec& spec = schedule_.funcs[f];
    for (size_t s = 0; s < spec.stages.size(); ++s) {
      if (spec.stages[s].directives.empty()) continue;
      const std::string stage = text("f", f, s ? text(".update(", s - 1, ")") : "");
      print_directives(stage, spec.stages[s].directives, f, static_cast<int>(s));
    }
  }

  void print_directives(const std::string& stage, const std::vector<Directive>& directives, int f,
                        int index) {
    for (const Directive& directive : directives) {
      if (directive.kind == Kind::Specialize) {
        const std::string name = text("special", ++specializations_);
        out_ << text("Stage ", name, " = ", stage, ".specialize(selector == ", directive.condition,
                     ");\n");
        print_directives(name, directive.nested, f, index);
      } else {
        print_directive(stage, directive, f, index);
      }
    }
  }

  void print_directive(const std::string& stage, const Directive& directive, int f, int index) {
    static const char* const verbs[] = {"split",           "fuse",
                                        "rename",          "reorder",
                                        "serial",          "vectorize",
                                        "unroll",          "parallel",
                                        "never_partition", "always_partition",
                                        "atomic",          "allow_race_conditions",
                                        "prefetch",        "specialize",
                                        "specialize_fail"};
    std::vector<std::string> arguments;
    if (directive.kind == Kind::Prefetch) {
      arguments.push_back(directive.source >= 0 ? text("f", directive.source)
                                                : text("image", -1 - directive.source));
    }
    for (const std::string& name : directive.loops) arguments.push_back(loop(name, f, index));
    if (directive.kind == Kind::Split) {
      declare(directive.loops[1]);
      declare(directive.loops[2]);
    }
    if (directive.kind == Kind::Fuse) declare(directive.loops[2]);
    if (directive.kind == Kind::Rename) declare(directive.loops[1]);
    if (directive.kind == Kind::SpecializeFail) arguments.push_back("\"no specialization fits\"");
    if (directive.factor > 0) arguments.push_back(std::to_string(directive.factor));
    if (directive.factor > 0 && directive.kind != Kind::Prefetch) {
      arguments.push_back(std::string("TailStrategy::") + tail_name(directive.tail));
    }
    out_ << stage << "." << verbs[static_cast<int>(directive.kind)] << "(" << join(arguments)
         << ");\n";
  }

  void print_func(int f) {
    const FuncScheduleSpec& spec = schedule_.funcs[f];
    const std::string name = text("f", f);
    print_placement(spec.placement, name);
    for (const DimensionRule& rule : spec.rules) print_rule(rule, name);
    if (!spec.storage_order.empty()) {
      std::vector<std::string> order;
      for (const int d : spec.storage_order) order.push_back(std::string(1, "xyz"[d]));
      out_ << name << ".reorder_storage(" << join(order) << ");\n";
    }
    if (spec.memory == MemoryType::Heap) out_ << name << ".store_in(MemoryType::Heap);\n";
    if (spec.memory == MemoryType::Stack) out_ << name << ".store_in(MemoryType::Stack);\n";
    if (spec.memoized) out_ << name << ".memoize();\n";
    if (spec.async) out_ << name << ".async();\n";
    if (spec.traced) out_ << name << ".trace_loads().trace_stores().trace_realizations();\n";
  }

  void print_rule(const DimensionRule& rule, const std::string& name) {
    static const char* const verbs[] = {"bound",        "bound_extent",  "align_bounds",
                                        "align_extent", "align_storage", "bound_storage",
                                        "fold_storage"};
    using Rule = DimensionRule::Kind;
    const bool two = rule.kind == Rule::Bound || rule.kind == Rule::AlignBounds;
    out_ << text(name, ".", verbs[static_cast<int>(rule.kind)], "(", name, ".args()[",
                 rule.dimension, "], ", rule.a);
    if (two) out_ << ", " << rule.b;
    if (rule.kind == Rule::FoldStorage && rule.b == 0) out_ << ", false";
    out_ << ");\n";
  }

  std::string level(int consumer, int stage, const std::string& name) const {
    return text("f", consumer, ", ", loop(name, consumer, stage));
  }

  void print_placement(const Placement& placement, const std::string& name) {
    if (placement.where == Where::Inline) out_ << name << ".compute_inline();\n";
    if (placement.where == Where::Root) out_ << name << ".compute_root();\n";
    if (placement.where != Where::At) return;
    out_ << name;
    print_level("hoist_storage", placement.hoist_consumer, placement.hoist_stage,
                placement.hoist_loop);
    print_level("store", placement.store_consumer, placement.store_stage, placement.store_loop);
    out_ << ".compute_at(" << level(placement.consumer, placement.stage, placement.compute_loop)
         << ");\n";
  }

  void print_level(const std::string& verb, int consumer, int stage, const std::string& loop) {
    if (loop.empty()) return;
    if (loop == "root") {
      out_ << "." << verb << "_root()";
    } else {
      out_ << "." << verb << (verb == "store" ? "_at(" : "(") << level(consumer, stage, loop)
           << ")";
    }
  }

  const ScheduleSpec& schedule_;
  const int first_derived_;
  int specializations_ = 0;
  std::ostringstream declarations_, out_;
};

}  // namespace

std::string to_cpp(const ScheduleSpec& schedule) { return SchedulePrinter(schedule).run(); }

}  // namespace retrograde::fuzz
