#include "diagnostics/error.h"
#include "graph/directives/directive_text.h"
#include "graph/directives/wrappers.h"
#include "graph/graph.h"
#include "graph/text/binder.h"
#include "ir/print.h"
#include "ir/text.h"

namespace retrograde::graph {

namespace {

class GraphPrinter {
 public:
  explicit GraphPrinter(const Graph& graph) {
    for (const FuncPtr& f : graph.funcs) declare(*f, types_);
    for (const ParameterPtr& p : graph.parameters) declare(*p, types_);
  }

  std::string run(const Graph& graph) {
    for (const auto& parameter : graph.parameters) print(*parameter);
    for (const FuncPtr& f : graph.funcs) print(*f);
    for (const FuncPtr& f : graph.outputs) print_output(*f);
    return std::move(out_);
  }

 private:
  template <typename... Parts>
  void line(const Parts&... parts) {
    out_.append(2 * indent_, ' ');
    out_ += text(shown(parts)...) + '\n';
  }
  template <typename Part>
  const Part& shown(const Part& part) const {
    return part;
  }
  std::string shown(const Expr& e) const {
    NameTypes types(&types_);
    return e.defined() ? ir::print(e, types) : "_";
  }
  template <typename Body>
  void indented(const Body& body) {
    ++indent_;
    body();
    --indent_;
  }
  void line_if(const char* word, const Expr& e) {
    if (e.defined()) line(word, " ", e);
  }

  // ---- parameters ----

  void print(const ParameterContents& p) {
    if (p.is_buffer) {
      line(p.is_literal ? "buffer " : "image ", to_string(p.type), " ", quote_name(p.name), "(",
           p.dimensions, ")");
    } else {
      line("param ", to_string(p.type), " ", quote_name(p.name));
    }
    indented([&] {
      if (p.value) line("value ", to_expr(*p.value));
      line_if("at_least", p.min_value);
      line_if("at_most", p.max_value);
      line_if("estimate", p.estimate);
      print_constraints(p);
      if (p.is_finite) line("finite");
      if (p.func) line("reader ", quote_name(p.func->name));
      print(p.trace);
    });
  }

  void print_constraints(const ParameterContents& p) {
    for (size_t d = 0; d < p.constraints.size(); ++d) {
      const BufferConstraint& c = p.constraints[d];
      if (c.min.defined() || c.extent.defined() || c.stride.defined()) {
        line("dim(", d, ", ", c.min, ", ", c.extent, ", ", c.stride, ")");
      }
      if (c.min_estimate.defined() || c.extent_estimate.defined()) {
        line("estimates(", d, ", ", c.min_estimate, ", ", c.extent_estimate, ")");
      }
      if (c.any_stride) line("any_stride(", d, ")");
    }
    if (p.host_alignment != 0) line("aligned(", p.host_alignment, ")");
  }

  void print(const TraceSchedule& trace) {
    if (trace.loads) line("trace_loads");
    if (trace.stores) line("trace_stores");
    if (trace.realizations) line("trace_realizations");
    for (const std::string& tag : trace.tags) line("trace_tag ", Expr(tag));
  }

  // ---- Funcs ----

  void print(const FuncContents& f) {
    line("func ", quote_name(f.name), "(", listed(f.args, quote_name), ")",
         f.types.empty() ? "" : " ", listed(f.types, [](Type type) { return to_string(type); }));
    indented([&] {
      if (f.made) print(*f.made);
      if (f.extern_definition) print(*f.extern_definition);
      for (int s = 0; s < f.stage_count(); ++s) {
        line(s == 0 ? "define" : "update");
        indented([&] { print(f.stage(s), f); });
      }
      print_schedule(f);
      for (const auto& [user, wrapper] : f.wrappers)
        line("wrapper ", user.empty() ? "_" : quote_name(user), " ", quote_name(wrapper->name));
      for (const auto& [image, copy] : f.copied_inputs)
        line("copied_input ", quote_name(image), " ", quote_name(copy->name));
      if (f.custom_derivatives) line("custom_derivatives");
    });
  }

  void print(const Provenance& made) {
    line("made ", role_name(made.role), made.of.empty() ? "" : " of " + quote_name(made.of));
    indented([&] {
      const AdjointTraits& t = made.traits;
      if (t.masked) line("masked");
      if (t.vanished) line("vanished");
      if (t.levelled) line("levelled");
      if (t.singular) line("singular");
      if (t.infinite) line("infinite");
      if (made.lanes > 0) line("lanes ", made.lanes);
      if (made.has_parts) line("parts");
      if (made.blocks > 0) line("blocks ", made.blocks);
      for (const AdjointWork& work : made.work) {
        line("work");
        for (const Expr& value : work.values) line("work_value ", value);
        for (const Expr& loop : work.loops) line("work_loop ", loop);
      }
    });
  }

  void print(const ExternDefinition& definition) {
    static constexpr const char* manglings[] = {"default", "c", "c++"};
    line("extern ", quote_name(definition.function), " ",
         manglings[static_cast<int>(definition.mangling)]);
    indented([&] {
      for (const ExternArgument& arg : definition.args) {
        switch (arg.kind) {
          case ExternArgument::Kind::Func:
            line("give_func ", quote_name(arg.func->name));
            break;
          case ExternArgument::Kind::Buffer:
            line("give_buffer ", quote_name(arg.buffer->name));
            break;
          case ExternArgument::Kind::Expr:
            line("give ", arg.expr);
            break;
        }
      }
    });
  }

  void print(const Definition& definition, const FuncContents& f) {
    if (&definition != &*f.pure) {
      for (const Expr& place : definition.args) line("place ", place);
    }
    for (const ReductionVariable& v : definition.rvars)
      line(v.numbers_points ? "points(" : "loop(", quote_name(v.var), ", ", v.min, ", ", v.extent,
           ")");
    line_if("where", definition.predicate);
    for (const Expr& value : definition.values) line("value ", value);
    print(definition.schedule, first_loops(f, definition));
  }

  void print(const StageLoops& schedule, const std::vector<Dim>& first) {
    for (const Directive& directive : directives_of(schedule, first)) line(to_text(directive));
    for (const StageLoops& special : schedule.specializations) {
      if (!special.failure.empty()) {
        line(to_text(SpecializeFail{special.failure}));
        continue;
      }
      line("specialize ", special.condition);
      indented([&] { print(special, first); });
      line("end");
    }
  }

  void print_schedule(const FuncContents& f) {
    const std::vector<Directive> log = directives_of(f);
    if (log.empty()) return;
    line("schedule");
    indented([&] {
      for (const Directive& directive : log) line(to_text(directive));
    });
  }

  void print_output(const FuncContents& f) {
    line("output ", quote_name(f.name));
    indented([&] {
      for (size_t i = 0; i < f.outputs.size(); ++i) {
        const ParameterContents& p = *f.outputs[i];
        if (f.outputs.size() > 1) line("component ", i);
        print_constraints(p);
      }
      for (const Requirement& requirement : f.requirements) {
        line("require ", requirement.condition);
        for (const Expr& part : requirement.message) line("message ", part);
      }
    });
  }

  NameTypes types_;
  std::string out_;
  size_t indent_ = 0;
};

}  // namespace

Graph graph_of(const std::vector<FuncPtr>& outputs) {
  return {outputs, functions_of(outputs), parameters_of(outputs)};
}

std::string to_text(const Graph& graph) { return GraphPrinter(graph).run(graph); }

}  // namespace retrograde::graph
