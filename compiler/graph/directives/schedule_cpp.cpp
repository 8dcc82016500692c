// Prints a schedule log as C++: declarations of the loops that it names, then a statement for each
// directive.
#include <cctype>
#include <map>
#include <set>
#include <sstream>

#include "diagnostics/error.h"
#include "graph/directives/directive_choices.h"
#include "graph/directives/schedule_log.h"
#include "graph/names.h"
#include "ir/buffer_metadata.h"
#include "ir/print.h"
#include "ir/text.h"
#include "ir/visit.h"

namespace retrograde {

namespace graph {

namespace {

using Entry = ScheduleLog::Entry;

// Turns names into distinct C++ identifiers.
class Identifiers {
 public:
  const std::string& operator()(const std::string& name) {
    std::string& result = of_[name];
    if (!result.empty()) return result;
    result = spelled(without_numbers(name));
    if (used_.count(result)) result = spelled(name);
    while (!used_.insert(result).second) result += "_";
    return result;
  }

 private:
  static std::string spelled(std::string name) {
    for (char& c : name) {
      if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    }
    return name;
  }
  std::map<std::string, std::string> of_;
  std::set<std::string> used_;
};

class CppPrinter {
 public:
  explicit CppPrinter(const ScheduleLog& log) : log_(log) {}

  std::string run() {
    for (const Entry& entry : log_.entries) identifiers_(entry.func);
    for (const Entry& entry : log_.entries) {
      entry_ = &entry;
      std::visit([&](const auto& d) { statements_ << statement(d) << ";\n"; }, entry.directive);
    }
    return declarations_.str() + statements_.str();
  }

 private:
  // ---- loops: declared at their first mention ----

  struct Source {
    std::string func;
    int stage = 0;
  };
  // The stage whose reduction variables a stage's loops are: follows created Funcs back to their
  // origin.
  Source source_of(Source of) const {
    for (auto created = created_.find(of.func); created != created_.end();
         created = created_.find(of.func))
      of = {created->second.func, created->second.stage < 0 ? of.stage : created->second.stage};
    return of;
  }

  std::string loop(const std::string& name, const Source& of) {
    const std::string& id = identifiers_(name);
    if (!declared_.insert(name).second) return id;
    const bool is_unnamed = log_.places.count("." + name);  // of a domain that the compiler made
    const size_t dot = is_unnamed ? 0 : name.rfind('.');
    if (dot == std::string::npos && log_.places.count(name)) {
      declarations_ << "Var " << id << " = " << identifiers_(source_of(of).func) << ".args()["
                    << log_.places.at(name) << "];\n";
    } else if (dot == std::string::npos) {
      declarations_ << (reductions_.count(name) ? "RVar " : "Var ") << id << "(\"" << name
                    << "\");\n";
    } else if (const Source source = source_of(of); source.stage > 0 && !index_of(name).empty()) {
      declarations_ << "RVar " << id << " = " << identifiers_(source.func) << ".rvars("
                    << source.stage - 1 << ")[" << index_of(name) << "];\n";
    } else {
      declarations_ << "RVar " << id << "(\"" << name << "\");\n";
    }
    return id;
  }
  // The position in its domain; empty when unknown.
  std::string index_of(const std::string& name) const {
    for (const std::string& key : {name, "." + name}) {
      if (const auto place = log_.places.find(key); place != log_.places.end())
        return std::to_string(place->second);
    }
    const std::string variable = name.substr(name.rfind('.') + 1);
    const size_t letter = std::string("xyzw").find(variable);
    if (variable.size() == 1 && letter != std::string::npos) return std::to_string(letter);
    return variable.find_first_not_of("0123456789") == std::string::npos ? variable : "";
  }
  bool is_reduction(const std::string& name) const {
    return name.find('.') != std::string::npos || log_.places.count("." + name) ||
           reductions_.count(name);
  }
  // Loops derived from a reduction loop are reduction loops.
  void note(const std::string& old, std::initializer_list<std::string> derived) {
    if (is_reduction(old)) reductions_.insert(derived.begin(), derived.end());
  }

  // ---- statements ----

  Source here() const { return {entry_->func, entry_->stage}; }

  std::string receiver() {
    std::string out = identifiers_(entry_->func);
    if (!entry_->special.empty()) return special_name(entry_->special);
    if (entry_->stage > 0) out += text(".update(", entry_->stage - 1, ")");
    return out;
  }
  std::string special_name(const std::vector<int>& path) {
    std::string out = identifiers_(entry_->func);
    if (entry_->stage > 0) out += text("_update", entry_->stage - 1);
    for (const int step : path) out += text("_special", step);
    return out;
  }

  std::string call(const char* method, const std::vector<std::string>& arguments) {
    return text(receiver(), ".", method, "(", listed(arguments), ")");
  }
  // Most directives have the same form in C++ as in text.
  template <typename D>
  std::string statement(D d) {
    std::vector<std::string> arguments;
    std::apply([&](const auto&... field) { (arguments.push_back(cpp(field)), ...); }, d.fields());
    return call(D::name, arguments);
  }
  std::string statement(const SplitLoop& d) {
    note(d.old, {d.outer, d.inner});
    return call(d.name, {cpp(d.old), cpp(d.outer), cpp(d.inner), cpp(d.factor), cpp(d.tail)});
  }
  std::string statement(const FuseLoops& d) {
    note(d.inner, {d.fused});
    note(d.outer, {d.fused});
    return call(d.name, {cpp(d.inner), cpp(d.outer), cpp(d.fused)});
  }
  std::string statement(const RenameLoop& d) {
    note(d.old, {d.renamed});
    return call(d.name, {cpp(d.old), cpp(d.renamed)});
  }
  std::string statement(const RunLoop& d) {
    static constexpr const char* methods[] = {"serial",     "parallel",    "vectorize", "unroll",
                                              "gpu_blocks", "gpu_threads", "gpu_lanes"};
    return call(methods[static_cast<int>(d.kind)], {cpp(d.loop)});
  }
  std::string statement(const ComputeWith& d) {
    if (d.align.empty()) return call(d.name, {cpp(d.level)});
    return call(d.name, {cpp(d.level), cpp(d.align)});
  }
  std::string statement(const Memoize& d) {
    if (!d.key.defined()) return call(d.name, {});
    return call(d.name, {"EvictionKey(" + cpp(d.key) + ")"});
  }
  std::string statement(const Specialize& d) {
    std::vector<int> path = entry_->special;
    path.push_back(specializations_[special_name(entry_->special)]++);
    return text("Stage ", special_name(path), " = ", call(d.name, {cpp(d.condition)}));
  }
  std::string statement(const Wrap& d) { return create_func(d.name, d.made, d.users); }
  std::string statement(const Clone& d) { return create_func(d.name, d.made, d.users); }
  std::string statement(const CopyInput& d) { return create_func(d.name, d.made, {d.image}); }
  std::string create_func(const char* method, const std::string& created,
                          const std::vector<NamedFunc>& users) {
    created_[created] = {entry_->func, -1};
    std::vector<std::string> arguments;
    if (!users.empty()) arguments.push_back(users.size() == 1 ? cpp(users[0]) : cpp(users));
    return text("Func ", identifiers_(created), " = ", call(method, arguments));
  }
  std::string statement(const FactorOut& d) {
    created_[d.made] = here();
    std::vector<std::string> pairs;
    for (const auto& [kept, variable] : d.preserved) {
      const std::string rvar = is_reduction(kept) ? cpp(kept) : text("RVar(\"", kept, "\")");
      pairs.push_back(text("{", rvar, ", ", cpp(variable), "}"));
    }
    return text("Func ", identifiers_(d.made), " = ", call(d.name, {"{" + listed(pairs) + "}"}));
  }

  // ---- arguments ----

  std::string cpp(const std::string& variable) { return loop(variable, here()); }
  std::string cpp(const NamedLoop& name) { return loop(name, here()); }
  std::string cpp(const NamedFunc& name) { return identifiers_(name); }
  std::string cpp(bool flag) { return flag ? "true" : "false"; }
  template <Enumeration E>
  std::string cpp(E value) {
    return text(Choices<E>::name, "::", choice_name(value));
  }
  std::string cpp(const LoopLevel& level) {
    if (level.kind == LoopLevel::Kind::Root) return "LoopLevel::root()";
    if (level.kind == LoopLevel::Kind::Inlined) return "LoopLevel::inlined()";
    const std::string stage = level.stage < 0 ? "" : text(", ", level.stage);
    return text("LoopLevel(", identifiers_(level.func), ", ",
                loop(level.var, {level.func, level.stage}), stage, ")");
  }
  template <typename A, typename B>
  std::string cpp(const std::pair<A, B>& both) {
    return text("{", cpp(both.first), ", ", cpp(both.second), "}");
  }
  template <typename T>
  std::string cpp(const std::vector<T>& list) {
    return "{" + listed(mapped(list, [&](const T& one) { return cpp(one); })) + "}";
  }

  static std::string type_of(Type type) {
    if (type.is_bool()) return "Bool()";
    if (type.is_float()) return text("Float(", type.bits(), ")");
    return text(type.is_int() ? "Int(" : "UInt(", type.bits(), ")");
  }

  std::string cpp(const Expr& e) {
    if (!e.defined()) return "Expr()";
    if (const Variable* v = e.as<Variable>()) return parameter(v->name);
    std::vector<std::string> parts;
    for_each_child(e, [&](const Expr& child) { parts.push_back(cpp(child)); });
    if (const InfixOperator* op = infix_operator(e.kind()))
      return text("(", parts[0], " ", op->symbol, " ", parts[1], ")");
    switch (e.kind()) {
      case Kind::Not:
        return "!" + parts[0];
      case Kind::Cast:
        return text("cast(", type_of(e.type()), ", ", parts[0], ")");
      case Kind::Min:
      case Kind::Max:
      case Kind::Select:
        return text(kind_word(e.kind()), "(", listed(parts), ")");
      case Kind::Call:
        return text(e.as<Call>()->name, "(", listed(parts), ")");
      default:
        return constant(e);
    }
  }
  static std::string constant(const Expr& e) {
    if (e.type() == Int(32) || e.type() == Float(32) || e.as<StringImm>()) return print(e);
    if (e.type().is_bool()) return text("Expr(", print(e), ")");
    const std::string digits = print(e);
    return text("cast(", type_of(e.type()), ", ", digits.substr(0, digits.find('_')), ")");
  }
  // A Param, or buffer metadata: input.extent.1
  std::string parameter(const std::string& name) {
    const auto parsed = parse_metadata_name(name);
    if (!parsed) return identifiers_(name);
    return text(identifiers_(parsed->buffer), ".dim(", parsed->dimension, ").",
                ir::to_string(parsed->what), "()");
  }

  const ScheduleLog& log_;
  const Entry* entry_ = nullptr;
  Identifiers identifiers_;
  std::set<std::string> declared_, reductions_;
  std::map<std::string, Source>
      created_;  // the Func that each was created from; for rfactor, the stage
  std::map<std::string, int> specializations_;  // the number of specializations of each stage
  std::ostringstream declarations_, statements_;
};

}  // namespace

}  // namespace graph

std::string ScheduleLog::to_cpp() const { return graph::CppPrinter(*this).run(); }

}  // namespace retrograde
