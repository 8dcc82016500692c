// A program as text in the manner of the language: what a report shows.
#include <sstream>

#include "gradient/adversary/program.h"
#include "ir/print.h"

namespace retrograde::gradient {

namespace {

std::string list(const std::vector<Expr>& exprs) {
  std::string result;
  for (const Expr& e : exprs) result += (result.empty() ? "" : ", ") + ir::print(e);
  return result;
}

void write_stage(std::ostream& out, const ir::FuncContents& f, const ir::Definition& d) {
  out << f.name << "(" << list(d.args) << ") = " << (d.values.size() > 1 ? "Tuple" : "") << "("
      << list(d.values) << ")";
  for (const ir::ReductionVariable& v : d.rvars)
    out << "  " << v.var << " in [" << v.min << ", +" << v.extent << ")";
  if (d.predicate.defined()) out << "  where " << d.predicate;
  out << ";\n";
}

void write_image(std::ostream& out, const ir::ParameterContents& p) {
  const oracle::Region region = oracle::region_of(*p.buffer);
  out << p.name << ": " << p.type;
  for (int extent : region.extents) out << " x " << extent;
  out << " = {";
  region.for_each([&](const std::vector<int>& at) {
    const ir::Scalar v = oracle::read_element(*p.buffer, at);
    out << (p.type.is_float() ? v.as_double() : static_cast<double>(v.i)) << " ";
  });
  out << "}\n";
}

}  // namespace

std::string to_text(const AdversaryProgram& program) {
  std::ostringstream out;
  const std::vector<ir::FuncPtr> outputs{program.output().function()};
  for (const auto& p : ir::parameters_of(outputs)) {
    if (p->is_buffer) {
      write_image(out, *p);
    } else {
      out << p->name << ": " << p->type << " = "
          << (p->type.is_float() ? p->value->f : double(p->value->i)) << "\n";
    }
  }
  for (const ir::FuncPtr& f : ir::topological_order(outputs)) {
    for (int s = 0; s < f->stage_count(); ++s) write_stage(out, *f, f->stage(s));
  }
  out << "output over";
  for (size_t d = 0; d < program.region.mins.size(); ++d)
    out << " [" << program.region.mins[d] << ", +" << program.region.extents[d] << ")";
  out << (program.options.overwritten == Overwritten::Store    ? ", values kept"
          : program.options.overwritten == Overwritten::Refuse ? ", overwriting refused"
                                                               : "")
      << (program.only_inputs ? ", gradients of inputs only" : "") << "\n";
  return out.str();
}

}  // namespace retrograde::gradient
