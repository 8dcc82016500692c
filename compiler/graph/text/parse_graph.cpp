// parse_graph.cpp -- parses in two passes over the lines: the first creates all named entities, so that the second may
// refer to them in any order.
#include "diagnostics/error.h"
#include "graph/definitions/define.h"
#include "graph/directives/directive_text.h"
#include "graph/directives/wrappers.h"
#include "graph/graph.h"
#include "graph/text/definition_reader.h"
#include "graph/text/func_lines.h"
#include "graph/text/parameter_lines.h"

namespace retrograde::graph {

namespace {

class GraphReader {
 public:
  explicit GraphReader(const std::string& text) : lines_(lines_of(text)) {}

  Graph run() {
    for (const Line& line : lines_) name(line);
    for (const Line& line : lines_) read(line);
    definition_.finish();
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
    p->dimensions = integer_argument(line, parse_arguments(line.rest.substr(open)), 0);
    p->constraints.resize(static_cast<size_t>(p->dimensions));
    declare(*p, declared_.types);
  }
  void make_param(const Line& line) {
    const size_t space = line.rest.find(' ');
    Type type;
    if (space == std::string::npos || !read_type(line.rest.substr(0, space), type))
      fail(line, "a type and a name");
    declare(*make_parameter(line, line.rest.substr(space + 1), type), declared_.types);
  }
  ParameterPtr make_parameter(const Line& line, const std::string& word, Type type) {
    parameter_ = std::make_shared<ParameterContents>();
    parameter_->name = unquoted(line, word);
    parameter_->type = type;
    if (!declared_.names.parameters.emplace(parameter_->name, parameter_).second)
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
    declare(*f_, declared_.types);
    f_->schedule.storage_dims = f_->args;
    make_outputs(*f_);
    for (const auto& output : f_->outputs) declared_.names.outputs[output->name] = output;
    if (!declared_.names.funcs.emplace(f_->name, f_).second) fail(line, "a name that is not taken");
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
    if (definition_.reads(line)) return;
    if (scheduling_ && reads_schedule(line)) return;
    if (output_ && reads_output(line)) return;
    if (f_ && reads_func(line)) return;
    if (parameter_ && reads_parameter(line, declared_, *parameter_)) return;
    fail(line, "something that belongs to what is above it");
  }

  void link_wrappers() {
    size_t owner = 0, reader = 0;
    for (const Line& line : pending_) {
      if (line.word == "reader") {
        const ParameterPtr& image = readers_[reader++];
        image->func = declared_.func(line, line.rest);
        declared_.names.funcs[image->func->name] = func_of_image(image);  // it owns the image
        continue;
      }
      const size_t space = line.rest.find(' ');
      if (space == std::string::npos) fail(line, "a user, an image or _, and a Func");
      const std::string of = line.rest.substr(0, space);
      FuncContents& f = *owners_[owner++];
      auto& kept = line.word == "wrapper" ? f.wrappers : f.copied_inputs;
      kept[of == "_" ? "" : unquoted(line, of)] = declared_.func(line, line.rest.substr(space + 1));
    }
    pending_.clear();
  }

  bool reads_entity(const Line& line) {
    const bool is_parameter = line.word == "image" || line.word == "buffer" || line.word == "param";
    if (!is_parameter && line.word != "func" && line.word != "output") return false;
    definition_.finish();
    f_ = nullptr;
    parameter_ = output_ = nullptr;
    scheduling_ = false;
    if (line.word == "func") f_ = declared_.func(line, line.rest.substr(0, opening(line.rest)));
    if (line.word == "output") {
      f_ = declared_.func(line, line.rest);
      outputs_.push_back(f_);
      output_ = f_->outputs.empty() ? nullptr : f_->outputs[0];
    }
    if (is_parameter) parameter_ = declared_.names.parameters.at(parameter_name(line));
    return true;
  }
  static std::string parameter_name(const Line& line) {
    const std::string named = line.rest.substr(line.rest.find(' ') + 1);
    return unquoted(line, line.word == "param" ? named : named.substr(0, named.rfind('(')));
  }

  bool reads_func(const Line& line) {
    if (line.word == "define" || line.word == "update") {
      definition_.finish();
      definition_.begin(f_, line.word == "update");
    } else if (line.word == "schedule") {
      definition_.finish();
      scheduling_ = true;
    } else if (line.word != "wrapper" && line.word != "copied_input" &&
               line.word != "custom_derivatives") {
      return reads_provenance(line, declared_, f_) || reads_extern(line, declared_, f_);
    }
    return true;
  }

  bool reads_schedule(const Line& line) {
    const auto directive = declared_.directive(line, false);
    if (directive) apply_directive(*directive, *f_);
    return directive.has_value();
  }

  bool reads_output(const Line& line) {
    if (line.word == "component") {
      const int i = declared_.integer(line);
      if (i < 0 || i >= static_cast<int>(f_->outputs.size())) fail(line, "a component of the Func");
      output_ = f_->outputs[static_cast<size_t>(i)];
    } else if (line.word == "require") {
      f_->requirements.push_back({declared_.expr(line, f_), {}});
    } else if (line.word == "message" && !f_->requirements.empty()) {
      f_->requirements.back().message.push_back(declared_.expr(line, f_));
    } else {
      return reads_constraint(line, declared_, *output_);
    }
    return true;
  }

  std::vector<Line> lines_;
  Declarations declared_;
  std::vector<FuncPtr> outputs_;
  // The current position in the text.
  FuncPtr f_;
  ParameterPtr parameter_, output_;
  DefinitionReader definition_{declared_};
  bool scheduling_ = false;
  // Lines about wrappers and image readers, whose Funcs may be defined later, and the Funcs they
  // belong to.
  std::vector<Line> pending_;
  std::vector<FuncPtr> owners_;
  std::vector<ParameterPtr> readers_;
};

}  // namespace

Graph parse_graph(const std::string& text) { return GraphReader(text).run(); }

}  // namespace retrograde::graph
