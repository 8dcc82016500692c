// Access graphs as text.
//
//   func blur
//     stage 0 (x, y)
//       write blur(x, y)
//       read input(clamped x - 1 in 0..63, y)
//       2 Add float32 by x, y
//
// A value that is not affine has a name by its number: v1(x, y). Numbers follow the order of the text.
#include <map>
#include <sstream>

#include "autoschedule/access/access_graph.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/text.h"
#include "simplify/simplify.h"

namespace retrograde::planning {

namespace {

class Printer {
 public:
  explicit Printer(const AccessGraph& graph) : graph_(graph) {}

  void add(const FuncNode& node) {
    out_ << "func " << node.func->name << (node.is_output ? " output" : "") << "\n";
    for (const StageNode& stage : node.stages) add(stage);
  }

  std::string of(const Access& access) {
    iterators_ = &graph_.stage(access.by).iterators;
    add(access);
    return out_.str();
  }

  std::string text() const { return out_.str(); }

 private:
  void add(const StageNode& stage) {
    iterators_ = &stage.iterators;
    out_ << "  stage " << stage.id.stage << " (";
    const char* comma = "";
    for (const Iterator& i : stage.iterators) {
      out_ << std::exchange(comma, ", ") << i.name;
      if (i.kind == Iterator::Kind::Reduction)
        out_ << " in [" << i.min << ", " << simplify(i.min + i.extent) << ")";
    }
    out_ << ")\n";
    if (!stage.guard.is_empty()) out_ << "    where " << guard(stage.guard) << "\n";
    out_ << "    write ";
    add(stage.write);
    for (const Access& read : stage.reads) {
      out_ << "    read ";
      add(read);
    }
    for (const OperationCount& row : stage.operations) {
      out_ << "    " << row.count << " " << row.name << " " << to_string(row.type)
           << names(row.depends, row.depends ? " by " : "")
           << names(row.decided_by, row.decided_by ? ", decided by " : "") << "\n";
    }
  }

  void add(const Access& access) {
    out_ << (access.of >= 0 ? graph_.func(access.of).func->name
                            : graph_.images()[static_cast<size_t>(access.image)]->name)
         << "(";
    const char* comma = "";
    for (const IndexForm& form : access.index) out_ << std::exchange(comma, ", ") << index(form);
    out_ << ")";
    if (access.components != 1) out_ << " components " << components(access.components);
    if (access.place.defined()) out_ << " place " << value(access.place);
    if (!access.guard.is_empty()) out_ << " where " << guard(access.guard);
    for (const FuncId f : access.through) out_ << " through " << graph_.func(f).func->name;
    out_ << "\n";
  }

  static std::string components(uint32_t set) {
    std::string result;
    for (int i = 0; i < 32; ++i)
      if (set >> i & 1) result += (result.empty() ? "" : ", ") + std::to_string(i);
    return result;
  }

  std::string names(IteratorSet set, const char* before) const {
    std::string result;
    for (size_t i = 0; i < iterators_->size(); ++i) {
      if ((set & set_of(static_cast<int>(i))) == 0) continue;
      result += (result.empty() ? before : ", ") + (*iterators_)[i].name;
    }
    return result;
  }

  std::string value(const Value& v) {
    const size_t number = numbers_.try_emplace(v.number, numbers_.size() + 1).first->second;
    std::string result = "v" + std::to_string(number) + "(";
    for (size_t i = 0; i < v.iterators.size(); ++i)
      result += (i ? ", " : "") + (*iterators_)[static_cast<size_t>(v.iterators[i])].name;
    return result + ")";
  }

  static void add_summand(std::string& sum, const std::string& name, int64_t coefficient) {
    const int64_t size = coefficient < 0 ? -coefficient : coefficient;
    if (coefficient < 0) sum += sum.empty() ? "-" : " - ";
    if (coefficient > 0) sum += sum.empty() ? "" : " + ";
    sum += size == 1 ? name : std::to_string(size) + " * " + name;
  }

  static std::string end(const Expr& e) {
    std::ostringstream out;
    if (e.defined()) out << simplify(e);
    return out.str();
  }

  std::string sum(const IndexForm& form) {
    std::string result;
    for (const Term& term : form.terms)
      add_summand(result, (*iterators_)[static_cast<size_t>(term.iterator)].name, term.coefficient);
    for (const OpaqueTerm& term : form.opaque) {
      std::string name = value(term.value);
      if (term.range.min.defined() || term.range.max.defined())
        name += " in " + end(term.range.min) + ".." + end(term.range.max);
      add_summand(result, name, term.coefficient);
    }
    if (form.low != form.high)
      result += (result.empty() ? "[" : " + [") + std::to_string(form.low) + ", " +
                std::to_string(form.high) + "]";
    else if (form.low < 0 && !result.empty())
      result += " - " + std::to_string(-form.low);
    else if (form.low != 0 || result.empty())
      result += (result.empty() ? "" : " + ") + std::to_string(form.low);
    return result;
  }

  std::string index(const IndexForm& form) {
    std::string result = sum(form);
    if (form.divisor != 1) result = "(" + result + ") / " + std::to_string(form.divisor);
    if (form.modulus != 0) result = "(" + result + ") % " + std::to_string(form.modulus);
    if (!form.clamped) return result;
    result = (form.turned ? "turned " : "clamped ") + result;
    const Interval& all = form.within;
    if (all.min.defined() || all.max.defined())
      result += " in " + end(all.min) + ".." + end(all.max);
    return result;
  }

  std::string guard(const Guard& guard) {
    std::string result;
    const auto add = [&](const std::string& condition) {
      result += (result.empty() ? "" : ", ") + condition;
    };
    for (const Congruence& c : guard.congruences)
      add("(" + sum(c.form) + ") % " + std::to_string(c.modulus) +
          " == " + std::to_string(c.remainder));
    for (const IndexForm& form : guard.nonnegative) add(index(form) + " >= 0");
    for (const Value& other : guard.others) add(value(other));
    return result;
  }

  const AccessGraph& graph_;
  const std::vector<Iterator>* iterators_ = nullptr;
  std::map<uint32_t, size_t> numbers_;
  std::ostringstream out_;
};

}  // namespace

std::string print(const AccessGraph& graph) {
  Printer printer(graph);
  for (const FuncNode& node : graph.funcs()) printer.add(node);
  return printer.text();
}

std::string print(const AccessGraph& graph, const Access& access) {
  return Printer(graph).of(access);
}

}  // namespace retrograde::planning
