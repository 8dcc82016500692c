// Text follows build_pipeline.cpp case by case.
#include "testing/print_program.h"

#include <sstream>

#include "diagnostics/error.h"
#include "ir/print.h"

namespace retrograde::fuzz {

namespace {

std::string join(const std::vector<std::string>& parts) {
  std::string result;
  for (const std::string& part : parts) result += (result.empty() ? "" : ", ") + part;
  return result;
}

std::string cpp_type(Type type) {
  if (type.is_bool()) return "bool";
  if (type == Float(32)) return "float";
  if (type == Float(64)) return "double";
  return to_string(type) + "_t";
}

std::string list(const std::vector<int>& values) {
  std::vector<std::string> parts;
  for (const int value : values) parts.push_back(std::to_string(value));
  return "{" + join(parts) + "}";
}

class Printer {
 public:
  explicit Printer(const PipelineSpec& spec) : spec_(spec) {}

  std::string definitions() {
    out_ << "Var x(\"x\"), y(\"y\"), z(\"z\");\n";
    for (size_t i = 0; i < spec_.images.size(); ++i) print_image(i);
    for (const ParameterSpec& p : spec_.parameters) {
      out_ << "Param<" << cpp_type(p.type) << "> p0; p0.set("
           << (p.type.is_float() ? text(p.value / 8.0, "f") : text(p.value)) << ");\n";
    }
    for (size_t f = 0; f < spec_.funcs.size(); ++f) print_func(static_cast<int>(f));
    return out_.str();
  }

 private:
  void print_image(size_t i) {
    static const char* const boundaries[] = {nullptr,        "constant_exterior",
                                             "repeat_edge",  "repeat_image",
                                             "mirror_image", "mirror_interior"};
    const ImageSpec& image = spec_.images[i];
    const std::string name = "image" + std::to_string(i);
    out_ << "Buffer<" << cpp_type(image.type) << "> " << name << "("
         << "std::vector<int>" << list(image.extents) << "); " << name << ".set_min("
         << list(image.mins) << ");  // noise, seed " << image.seed << "\n";
    if (image.boundary == Boundary::Clamp) return;
    out_ << "Func bounded" << i
         << " = BoundaryConditions::" << boundaries[static_cast<int>(image.boundary)] << "(" << name
         << (image.boundary == Boundary::Constant ? ", cast<" + cpp_type(image.type) + ">(7)" : "")
         << ");\n";
  }

  void print_func(int f) {
    const FuncSpec& func = spec_.funcs[f];
    const std::string name = "f" + std::to_string(f);
    out_ << "Func " << name << "(\"" << name << "\");\n";
    variables_.clear();
    for (int d = 0; d < func.dimensions; ++d) variables_.push_back(std::string(1, "xyz"[d]));
    print_definition(name + "(" + join(variables_) + ")", func.values);
    for (size_t u = 0; u < func.updates.size(); ++u) print_update(f, static_cast<int>(u));
  }

  void print_update(int f, int u) {
    const FuncSpec& func = spec_.funcs[f];
    const UpdateSpec& update = func.updates[u];
    const std::string name = "f" + std::to_string(f);
    const std::string domain = "r" + std::to_string(f) + "_" + std::to_string(u);
    variables_.resize(func.dimensions);
    if (!update.domain.empty()) out_ << "RDom " << domain << "(" << ranges(update.domain) << ");\n";
    add_variables(domain, update.domain);
    self_ = name;
    if (!update.predicate.empty()) {
      out_ << domain << ".where(" << expr(update.predicate[0]) << ");\n";
    }
    std::vector<std::string> left;
    for (const Index& index : update.left) left.push_back(coordinate(index));
    print_definition(name + "(" + join(left) + ")", update.values);
  }

  void print_definition(const std::string& left, const std::vector<Term>& values) {
    std::vector<std::string> parts;
    for (const Term& value : values) parts.push_back(expr(value));
    out_ << left << " = " << (parts.size() == 1 ? parts[0] : "Tuple(" + join(parts) + ")") << ";\n";
  }

  static std::string ranges(const std::vector<ReductionRange>& domain) {
    std::vector<std::string> parts;
    for (const ReductionRange& range : domain) parts.push_back(text(range.min, ", ", range.extent));
    return join(parts);
  }

  void add_variables(const std::string& domain, const std::vector<ReductionRange>& ranges) {
    for (size_t k = 0; k < ranges.size(); ++k) variables_.push_back(text(domain, "[", k, "]"));
  }

  std::string coordinate(const Index& index) {
    std::string e = std::to_string(index.offset);
    if (!index.data.empty()) {
      e = expr(index.data[0]);
    } else if (index.variable >= 0) {
      e = variables_[index.variable];
      if (index.scale != 1) e += text(" * ", index.scale);
      if (index.divisor != 1) e += text(" / ", index.divisor);
      if (index.offset != 0)
        e += index.offset < 0 ? text(" - ", -index.offset) : text(" + ", index.offset);
    }
    return index.clamped ? text("clamp(", e, ", ", index.low, ", ", index.high, ")") : e;
  }

  std::string access(const std::string& name, const Term& term, int values) {
    std::vector<std::string> at;
    for (const Index& index : term.indices) at.push_back(coordinate(index));
    const std::string read = name + "(" + join(at) + ")";
    return values > 1 ? text(read, "[", term.element, "]") : read;
  }

  std::string reduction(const Term& term) {
    const std::string name = "q" + std::to_string(++reductions_);
    out_ << "RDom " << name << "(" << ranges(term.domain) << ");\n";
    const size_t outer = variables_.size();
    add_variables(name, term.domain);
    const std::string operand = expr(term.operands[0]);
    variables_.resize(outer);
    static const char* const names[] = {"sum", "product", "maximum", "minimum", "argmax"};
    const int which = static_cast<int>(term.action) - static_cast<int>(Action::Sum);
    const std::string element =
        term.action == Action::ArgMax ? text("[", term.element, "]") : std::string();
    return text(names[which], "(", name, ", ", operand, ")", element);
  }

  std::string constant(const Term& term) {
    if (term.type == Int(32)) return std::to_string(term.value);
    const double value = term.type.is_float() ? term.value / 8.0 : static_cast<double>(term.value);
    return text("cast<", cpp_type(term.type), ">(", value, ")");
  }

  std::string expr(const Term& term) {
    switch (term.action) {
      case Action::Constant:
        return constant(term);
      case Action::Variable:
        return variables_[term.source];
      case Action::Parameter:
        return "Expr(p0)";
      case Action::Image: {
        const bool clamped = spec_.images[term.source].boundary == Boundary::Clamp;
        return access((clamped ? "image" : "bounded") + std::to_string(term.source), term, 1);
      }
      case Action::Func:
        return access("f" + std::to_string(term.source), term,
                      static_cast<int>(spec_.funcs[term.source].values.size()));
      case Action::Self:
        return access(self_, term, static_cast<int>(spec_.funcs[self_[1] - '0'].values.size()));
      default:
        return is_inline_reduction(term.action) ? reduction(term) : operation(term);
    }
  }

  std::string operation(const Term& term) {
    static const std::vector<std::string> names = {"cast",  "saturating_cast",
                                                   "!",     "-",
                                                   "abs",   "floor",
                                                   "sqrt",  "exp",
                                                   "sin",   "+",
                                                   "-",     "*",
                                                   "/",     "%",
                                                   "min",   "max",
                                                   "absd",  "&",
                                                   "|",     "^",
                                                   "<<",    ">>",
                                                   "<",     "<=",
                                                   "==",    "&&",
                                                   "||",    "select",
                                                   "clamp", "lerp"};
    std::string name = names[static_cast<int>(term.action) - static_cast<int>(Action::Cast)];
    std::vector<std::string> e;
    for (const Term& operand : term.operands) e.push_back(expr(operand));
    if (term.action == Action::Cast || term.action == Action::SaturatingCast) {
      name += "<" + cpp_type(term.type) + ">";
    }
    const bool is_word = name[0] >= 'a' && name[0] <= 'z';
    if (is_word) return name + "(" + join(e) + ")";
    if (e.size() == 1) return name + "(" + e[0] + ")";
    return "(" + e[0] + " " + name + " " + e[1] + ")";
  }

  const PipelineSpec& spec_;
  std::ostringstream out_;
  std::vector<std::string> variables_;
  std::string self_;
  int reductions_ = 0;
};

}  // namespace

std::string to_cpp(const PipelineSpec& pipeline, const ScheduleLog& schedule) {
  std::string result = Printer(pipeline).definitions();
  for (const auto& p : parameters_of(schedule))
    result += text("Param<int> ", p->name, "; ", p->name, ".set(", ir::to_expr(*p->value), ");\n");
  result += "{\n" + schedule.to_cpp() + "}\n";  // it has Vars of its own
  for (const OutputSpec& output : pipeline.outputs) {
    result += text("// output f", output.func, " over mins ", list(output.mins), ", extents ",
                   list(output.extents), "\n");
  }
  for (const auto& regions : pipeline.sweep) {
    for (const RegionSpec& region : regions) {
      result +=
          text("// then over mins ", list(region.mins), ", extents ", list(region.extents), "\n");
    }
  }
  return result;
}

}  // namespace retrograde::fuzz
