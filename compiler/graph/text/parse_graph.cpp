// Parses in two passes over the lines: the first creates all named entities, so that the second may
// refer to them in any order.
#include <map>
#include <optional>

#include "diagnostics/error.h"
#include "graph/definitions/define.h"
#include "graph/directives/directive_text.h"
#include "graph/graph.h"
#include "graph/text/binder.h"
#include "graph/text/graph_lines.h"
#include "ir/build.h"
#include "ir/parse.h"
#include "ir/print.h"
#include "ir/text.h"

namespace retrograde::graph {

namespace {

class GraphReader {
 public:
  explicit GraphReader(const std::string& text) : lines_(lines_of(text)) {}

  Graph run() {
    for (const Line& line : lines_) name(line);
    for (const Line& line : lines_) read(line);
    finish_definition();
    if (outputs_.empty())
      user_error("read the text of a graph", "it names its outputs", "it has no output line",
                 "End it with output and the name of a Func");
    return graph_of(outputs_);
  }

 private:
  // ---- pass 1: names ----

  void name(const Line& line) {
    if (line.word == "image" || line.word == "buffer") make_buffer(line);
    if (line.word == "param") make_param(line);
    if (line.word == "func") make_func(line);
    if (line.word == "wrapper" || line.word == "copied_input")
      pending_.push_back(line), owners_.push_back(f_);
    if (line.word == "reader") pending_.push_back(line), readers_.push_back(parameter_);
  }

  void make_buffer(const Line& line) {
    const size_t space = line.rest.find(' '), open = line.rest.rfind('(');
    Type type;
    if (space == std::string::npos || open == std::string::npos ||
        !read_type(line.rest.substr(0, space), type))
      fail(line, "a type, a name and the number of dimensions");
    ParameterPtr p = make_parameter(line, line.rest.substr(space + 1, open - space - 1), type);
    p->is_buffer = true;
    p->is_literal = line.word == "buffer";
    p->dimensions = integer(line, parse_arguments(line.rest.substr(open)), 0);
    p->constraints.resize(static_cast<size_t>(p->dimensions));
    declare(*p, types_);
  }
  void make_param(const Line& line) {
    const size_t space = line.rest.find(' ');
    Type type;
    if (space == std::string::npos || !read_type(line.rest.substr(0, space), type))
      fail(line, "a type and a name");
    declare(*make_parameter(line, line.rest.substr(space + 1), type), types_);
  }
  ParameterPtr make_parameter(const Line& line, const std::string& word, Type type) {
    parameter_ = std::make_shared<ParameterContents>();
    parameter_->name = unquoted(line, word);
    parameter_->type = type;
    if (!names_.parameters.emplace(parameter_->name, parameter_).second)
      fail(line, "a name that is not taken");
    return parameter_;
  }

  void make_func(const Line& line) {
    const size_t open = opening(line.rest), close = line.rest.rfind(')');
    if (open == std::string::npos || close == std::string::npos)
      fail(line, "a Func with its variables");
    f_ = std::make_shared<FuncContents>();
    f_->name = unquoted(line, line.rest.substr(0, open));
    for (const Expr& arg : parse_arguments(line.rest.substr(open, close + 1 - open))) {
      const Variable* v = arg.defined() ? arg.as<Variable>() : nullptr;
      if (!v) fail(line, "a list of variables");
      f_->args.push_back(v->name);
    }
    f_->types = types_of(line, line.rest.substr(close + 1));
    declare(*f_, types_);
    f_->schedule.storage_dims = f_->args;
    make_outputs(*f_);
    for (const auto& output : f_->outputs) names_.outputs[output->name] = output;
    if (!names_.funcs.emplace(f_->name, f_).second) fail(line, "a name that is not taken");
  }
  // A name in back quotes may contain a parenthesis.
  static size_t opening(const std::string& s) {
    const size_t from = s[0] == '`' ? s.find('`', 1) : 0;
    return s.find('(', from);
  }

  // ---- pass 2: contents ----

  void read(const Line& line) {
    link_wrappers();
    if (reads_entity(line)) return;
    if (definition_ && reads_definition(line)) return;
    if (scheduling_ && reads_schedule(line)) return;
    if (output_ && reads_output(line)) return;
    if (f_ && reads_func(line)) return;
    if (parameter_ && reads_parameter(line)) return;
    fail(line, "something that belongs to what is above it");
  }

  void link_wrappers() {
    size_t owner = 0, reader = 0;
    for (const Line& line : pending_) {
      if (line.word == "reader") {
        readers_[reader++]->func = func_named(line, line.rest);
        continue;
      }
      const size_t space = line.rest.find(' ');
      if (space == std::string::npos) fail(line, "a user, an image or _, and a Func");
      const std::string of = line.rest.substr(0, space);
      FuncContents& f = *owners_[owner++];
      auto& kept = line.word == "wrapper" ? f.wrappers : f.copied_inputs;
      kept[of == "_" ? "" : unquoted(line, of)] = func_named(line, line.rest.substr(space + 1));
    }
    pending_.clear();
  }

  bool reads_entity(const Line& line) {
    const bool is_parameter = line.word == "image" || line.word == "buffer" || line.word == "param";
    if (!is_parameter && line.word != "func" && line.word != "output") return false;
    finish_definition();
    f_ = nullptr;
    parameter_ = output_ = nullptr;
    scheduling_ = false;
    if (line.word == "func") f_ = func_named(line, line.rest.substr(0, opening(line.rest)));
    if (line.word == "output") {
      f_ = func_named(line, line.rest);
      outputs_.push_back(f_);
      output_ = f_->outputs.empty() ? nullptr : f_->outputs[0];
    }
    if (is_parameter) parameter_ = names_.parameters.at(parameter_name(line));
    return true;
  }
  static std::string parameter_name(const Line& line) {
    const std::string named = line.rest.substr(line.rest.find(' ') + 1);
    return unquoted(line, line.word == "param" ? named : named.substr(0, named.rfind('(')));
  }

  bool reads_parameter(const Line& line) {
    ParameterContents& p = *parameter_;
    if (line.word == "value") {
      p.value = as_scalar(expr(line));
    } else if (line.word == "at_least") {
      p.min_value = expr(line);
    } else if (line.word == "at_most") {
      p.max_value = expr(line);
    } else if (line.word == "estimate") {
      p.estimate = expr(line);
    } else if (line.word == "finite") {
      p.is_finite = true;
    } else if (line.word != "reader") {
      return reads_constraint(line, p) || reads_trace(line, p.trace);
    }
    return true;
  }

  bool reads_constraint(const Line& line, ParameterContents& p) {
    if (line.word != "dim" && line.word != "estimates" && line.word != "any_stride" &&
        line.word != "aligned")
      return false;
    const std::vector<Expr> args = bound(parse_arguments(line.rest, types_));
    const int first = integer(line, args, 0);
    if (line.word == "aligned") {
      p.host_alignment = first;
      return true;
    }
    if (first < 0 || first >= static_cast<int>(p.constraints.size()))
      fail(line, "a dimension of the buffer");
    BufferConstraint& c = p.constraints[static_cast<size_t>(first)];
    if (line.word == "any_stride") {
      c.any_stride = true;
    } else if (line.word == "dim" && args.size() == 4) {
      c.min = args[1], c.extent = args[2], c.stride = args[3];
    } else if (line.word == "estimates" && args.size() == 3) {
      c.min_estimate = args[1], c.extent_estimate = args[2];
    } else {
      fail(line, "min, extent and stride, or _");
    }
    return true;
  }

  static bool reads_trace(const Line& line, TraceSchedule& trace) {
    if (line.word == "trace_loads") {
      trace.loads = true;
    } else if (line.word == "trace_stores") {
      trace.stores = true;
    } else if (line.word == "trace_realizations") {
      trace.realizations = true;
    } else if (line.word == "trace_tag") {
      trace.tags.push_back(string_of(line));
    } else {
      return false;
    }
    return true;
  }

  bool reads_func(const Line& line) {
    if (line.word == "made") {
      read_provenance(line);
    } else if (line.word == "define" || line.word == "update") {
      begin_definition(line.word == "update");
    } else if (line.word == "extern") {
      read_extern(line);
    } else if (line.word == "schedule") {
      finish_definition();
      scheduling_ = true;
    } else if (line.word != "wrapper" && line.word != "copied_input" &&
               line.word != "custom_derivatives") {
      return reads_made(line) || reads_extern(line);
    }
    return true;
  }

  void read_provenance(const Line& line) {
    const size_t of = line.rest.find(" of ");
    const std::string word = line.rest.substr(0, of);
    Provenance& made = f_->made.emplace();
    if (of != std::string::npos) made.of = unquoted(line, line.rest.substr(of + 4));
    for (int r = 0; r < role_count; ++r) {
      made.role = static_cast<Role>(r);
      if (word == role_name(made.role)) return;
    }
    fail(line, "a role of roles.def");
  }
  bool reads_made(const Line& line) {
    if (!f_->made) return false;
    Provenance& made = *f_->made;
    AdjointTraits& t = made.traits;
    const std::map<std::string, bool*> flags{{"masked", &t.masked},     {"vanished", &t.vanished},
                                             {"levelled", &t.levelled}, {"singular", &t.singular},
                                             {"infinite", &t.infinite}, {"parts", &made.has_parts}};
    if (const auto flag = flags.find(line.word); flag != flags.end()) {
      *flag->second = true;
    } else if (line.word == "lanes") {
      made.lanes = integer(line, {parse_expr(line.rest, types_)}, 0);
    } else if (line.word == "blocks") {
      made.blocks = integer(line, {parse_expr(line.rest, types_)}, 0);
    } else if (line.word == "work") {
      made.work.emplace_back();
    } else if ((line.word == "work_value" || line.word == "work_loop") && !made.work.empty()) {
      (line.word == "work_value" ? made.work.back().values : made.work.back().loops)
          .push_back(expr(line));
    } else {
      return false;
    }
    return true;
  }

  void read_extern(const Line& line) {
    const size_t space = line.rest.rfind(' ');
    if (space == std::string::npos) fail(line, "a C function and how its name is mangled");
    const std::string mangling = line.rest.substr(space + 1);
    ExternDefinition& definition = f_->extern_definition.emplace();
    definition.function = unquoted(line, line.rest.substr(0, space));
    definition.mangling = mangling == "c"     ? NameMangling::C
                          : mangling == "c++" ? NameMangling::CPlusPlus
                                              : NameMangling::Default;
  }
  bool reads_extern(const Line& line) {
    if (!f_->extern_definition) return false;
    ExternArgument arg;
    if (line.word == "give") {
      arg.expr = expr(line);
    } else if (line.word == "give_func") {
      arg.kind = ExternArgument::Kind::Func;
      arg.func = func_named(line, line.rest);
    } else if (line.word == "give_buffer") {
      const auto found = names_.parameters.find(unquoted(line, line.rest));
      if (found == names_.parameters.end()) fail(line, "an image or buffer of the graph");
      arg.kind = ExternArgument::Kind::Buffer;
      arg.buffer = found->second;
    } else {
      return false;
    }
    f_->extern_definition->args.push_back(std::move(arg));
    return true;
  }

  // ---- definitions: bound to their entities once complete ----

  void begin_definition(bool is_update) {
    finish_definition();
    definition_ = Definition();
    is_update_ = is_update;
    if (!is_update) {
      for (const std::string& arg : f_->args) definition_->args.push_back(variable(arg));
    }
    specials_.clear();
  }

  bool reads_definition(const Line& line) {
    if (line.word == "place") {
      definition_->args.push_back(parse_with_names(line.rest, types_, names_));
    } else if (line.word == "value") {
      definition_->values.push_back(parse_with_names(line.rest, types_, names_));
    } else if (line.word == "where") {
      definition_->predicate = parse_with_names(line.rest, types_, names_);
    } else if (line.word == "loop" || line.word == "points") {
      const std::vector<Expr> args = parse_arguments(line.rest, types_);
      const Variable* v = args.size() == 3 && args[0].defined() ? args[0].as<Variable>() : nullptr;
      if (!v) fail(line, "a variable, its min and its extent");
      definition_->rvars.push_back({v->name, args[1], args[2], line.word == "points"});
    } else {
      return reads_stage_schedule(line);
    }
    return true;
  }

  bool reads_stage_schedule(const Line& line) {
    StageLoops& now = stage_schedule();
    if (line.word == "specialize") {
      StageLoops special;
      special.dims = first_loops(*f_, *definition_);
      special.condition = expr(line);
      special.is_given = now.is_given = true;
      now.specializations.push_back(std::move(special));
      specials_.push_back(now.specializations.size() - 1);
    } else if (line.word == "end" && !specials_.empty()) {
      specials_.pop_back();
    } else if (const auto directive = directive_of(line, true)) {
      apply_directive(*directive, now);
    } else {
      return false;
    }
    return true;
  }
  // The schedule that directives go to: the stage's, or an open specialization's.
  StageLoops& stage_schedule() {
    StageLoops* now = &definition_->schedule;
    if (now->dims.empty()) now->dims = first_loops(*f_, *definition_);
    for (const size_t special : specials_) now = &now->specializations[special];
    return *now;
  }

  void finish_definition() {
    if (!definition_) return;
    stage_schedule();
    DomainPtr domain;
    if (!definition_->rvars.empty()) domain = make_domain(definition_->rvars);
    const Binder bind(names_, f_, domain);
    Definition complete = map_exprs(*definition_, bind);
    if (domain) {
      domain->vars = complete.rvars;
      // The domain refers to its own variables weakly, so that it does not own itself.
      if (complete.predicate.defined())
        domain->predicate =
            rebind_symbol(complete.predicate, domain.get(), SymbolRef::weak(domain));
    }
    if (is_update_) {
      f_->updates.push_back(std::move(complete));
    } else {
      f_->pure = std::move(complete);
    }
    definition_.reset();
  }
  // Parses the line as a directive of a stage, or of a Func, as requested; nothing if it is another
  // line.
  std::optional<Directive> directive_of(const Line& line, bool of_stage) const {
    std::optional<Directive> directive = parse_directive(line.content);
    if (!directive || is_of_stage(*directive) != of_stage) return std::nullopt;
    Binder(names_, nullptr, nullptr)(*directive);
    return directive;
  }
  bool reads_schedule(const Line& line) {
    const auto directive = directive_of(line, false);
    if (directive) apply_directive(*directive, *f_);
    return directive.has_value();
  }

  bool reads_output(const Line& line) {
    if (line.word == "component") {
      const int i = integer(line, {parse_expr(line.rest, types_)}, 0);
      if (i < 0 || i >= static_cast<int>(f_->outputs.size())) fail(line, "a component of the Func");
      output_ = f_->outputs[static_cast<size_t>(i)];
    } else if (line.word == "require") {
      f_->requirements.push_back({expr(line), {}});
    } else if (line.word == "message" && !f_->requirements.empty()) {
      f_->requirements.back().message.push_back(expr(line));
    } else {
      return reads_constraint(line, *output_);
    }
    return true;
  }

  // ---- words ----

  FuncPtr func_named(const Line& line, const std::string& word) const {
    const auto found = names_.funcs.find(unquoted(line, word));
    if (found == names_.funcs.end()) fail(line, "a Func of the graph");
    return found->second;
  }
  Expr expr(const Line& line) const {
    return Binder(names_, f_, nullptr)(parse_with_names(line.rest, types_, names_));
  }
  std::vector<Expr> bound(std::vector<Expr> args) const {
    for (Expr& arg : args) {
      if (arg.defined()) arg = Binder(names_, nullptr, nullptr)(arg);
    }
    return args;
  }
  static std::string string_of(const Line& line) {
    const Expr e = parse_expr(line.rest);
    const StringImm* value = e.as<StringImm>();
    if (!value) fail(line, "a text in quotes");
    return value->value;
  }
  static int integer(const Line& line, const std::vector<Expr>& args, size_t i) {
    const auto value = i < args.size() && args[i].defined() ? as_const_int(args[i]) : std::nullopt;
    if (!value) fail(line, "an integer");
    return static_cast<int>(*value);
  }

  std::vector<Line> lines_;
  NamedEntities names_;
  NameTypes types_;  // of all that is declared
  std::vector<FuncPtr> outputs_;
  // The current position in the text.
  FuncPtr f_;
  ParameterPtr parameter_, output_;
  std::optional<Definition> definition_;
  bool is_update_ = false, scheduling_ = false;
  std::vector<size_t> specials_;
  // Lines about wrappers and image readers, whose Funcs may be defined later, and the Funcs they
  // belong to.
  std::vector<Line> pending_;
  std::vector<FuncPtr> owners_;
  std::vector<ParameterPtr> readers_;
};

}  // namespace

Graph parse_graph(const std::string& text) { return GraphReader(text).run(); }

}  // namespace retrograde::graph
