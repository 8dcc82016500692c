// Errors and prints: a constant format and the values that it shows go to the runtime in one call.
#include "codegen/function_generator.h"
#include "diagnostics/error.h"

namespace retrograde::codegen {

using namespace ir;

static std::string escaped(const std::string& text) {
  std::string result;
  for (char c : text) result += c == '%' ? std::string("%%") : std::string(1, c);
  return result;
}

void FunctionGenerator::add_part(Format& format, const Expr& part, int which, bool printed) {
  if (const auto* literal = part.as<StringImm>()) {
    format.text += escaped(literal->value);
    return;
  }
  const Type type = part.type().element_of();
  Value* v = lane(e_, value(part), part.type().lanes() == 1 ? 0 : which);
  if (type.is_handle()) {
    format.text += "%p";
  } else if (type.is_bool()) {
    format.text += "%s";
    v = b_.CreateSelect(v, string_constant("true"), string_constant("false"));
  } else if (type.is_float()) {
    // Printed as Halide prints them; in errors as short as they can be.
    if (printed)
      format.text += type.bits() == 64 ? "%E" : "%F";
    else
      format.text += type.bits() == 64 ? "%f" : "%g";
    v = convert(e_, Float(64), type, v);
  } else {
    format.text += type.is_int() ? "%i" : "%u";
    v = b_.CreateIntCast(v, b_.getInt64Ty(), type.is_int());
  }
  format.args.push_back(v);
}

Value* FunctionGenerator::report_error(Value* code, const std::vector<Expr>& parts, size_t first,
                                       const std::string& separator) {
  Format format;
  for (size_t i = first; i < parts.size(); i++) {
    if (i > first) format.text += separator;
    add_part(format, parts[i], 0, false);
  }
  return call_runtime("retrograde_report_error", b_.getInt32Ty(),
                      {code, string_constant(format.text)}, &format.args);
}

void FunctionGenerator::print(const std::vector<Expr>& parts, size_t first, int which) {
  Format format;
  for (size_t i = first; i < parts.size(); i++) {
    if (i > first) format.text += " ";
    add_part(format, parts[i], which, true);
  }
  format.text += "\n";
  call_runtime("retrograde_print", b_.getVoidTy(), {string_constant(format.text)}, &format.args);
}

// print(value, parts...) or print_when(condition, value, parts...): a line for each lane.
Value* FunctionGenerator::print_call(const Call& e) {
  const size_t first = e.op == Op::print_when ? 1 : 0;
  Value* condition = first ? value(e.args[0]) : nullptr;
  int lanes = 1;
  for (const Expr& arg : e.args) {
    value(arg);  // here, so that no value is first computed under a condition
    lanes = std::max(lanes, arg.type().lanes());
  }
  for (int i = 0; i < lanes; i++) {
    if (!condition) {
      print(e.args, first, i);
    } else {
      if_true(lane(e_, condition, lanes_of(condition) == 1 ? 0 : i),
              [&] { print(e.args, first, i); });
    }
  }
  return value(e.args[first]);
}

}  // namespace retrograde::codegen
