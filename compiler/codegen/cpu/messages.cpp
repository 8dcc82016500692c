// Error messages and prints: one runtime call gets a constant format and the values to show.
#include "codegen/values/calls.h"
#include "diagnostics/error.h"

namespace retrograde::codegen {

using namespace ir;

namespace {

struct MessageFormat {
  std::string text;
  std::vector<Value*> args;
};

std::string escaped(const std::string& text) {
  std::string result;
  for (char c : text) result += c == '%' ? std::string("%%") : std::string(1, c);
  return result;
}

// `which`: the lane to show if the part is a vector.
void add_part(Values& values, MessageFormat& format, const Expr& part, int which, bool printed) {
  FunctionContext& c = values.c;
  if (const auto* literal = part.as<StringImm>()) {
    format.text += escaped(literal->value);
    return;
  }
  const Type type = part.type().element_of();
  Value* v = lane(c.e, values.of(part), part.type().lanes() == 1 ? 0 : which);
  if (type.is_handle()) {
    format.text += "%p";
  } else if (type.is_bool()) {
    format.text += "%s";
    v = c.b.CreateSelect(v, c.string_constant("true"), c.string_constant("false"));
  } else if (type.is_float()) {
    // Prints use Halide's format; errors use the shortest form.
    if (printed)
      format.text += type.bits() == 64 ? "%E" : "%F";
    else
      format.text += type.bits() == 64 ? "%f" : "%g";
    v = convert(c.e, Float(64), type, v);
  } else {
    format.text += type.is_int() ? "%i" : "%u";
    v = c.b.CreateIntCast(v, c.b.getInt64Ty(), type.is_int());
  }
  format.args.push_back(v);
}

MessageFormat format_of(Values& values, const std::vector<Expr>& parts, size_t first,
                        const std::string& separator, int which, bool printed) {
  MessageFormat format;
  for (size_t i = first; i < parts.size(); i++) {
    if (i > first) format.text += separator;
    add_part(values, format, parts[i], which, printed);
  }
  return format;
}

void print(Values& values, const std::vector<Expr>& parts, size_t first, int which) {
  FunctionContext& c = values.c;
  const MessageFormat format = format_of(values, parts, first, " ", which, true);
  c.call_runtime("retrograde_print", c.b.getVoidTy(), {c.string_constant(format.text + "\n")},
                 &format.args);
}

}  // namespace

Value* report_error(Values& values, Value* code, const std::vector<Expr>& parts, size_t first,
                    const std::string& separator) {
  FunctionContext& c = values.c;
  const MessageFormat format = format_of(values, parts, first, separator, 0, false);
  return c.call_runtime("retrograde_report_error", c.b.getInt32Ty(),
                        {code, c.string_constant(format.text)}, &format.args);
}

// print(value, parts...) or print_when(condition, value, parts...): prints one line per lane.
Value* print_call(Values& values, const Call& e) {
  FunctionContext& c = values.c;
  const size_t first = e.op == Op::print_when ? 1 : 0;
  Value* condition = first ? values.of(e.args[0]) : nullptr;
  int lanes = 1;
  for (const Expr& arg : e.args) {
    values.of(arg);  // evaluated here, so that no value is first computed under a condition
    lanes = std::max(lanes, arg.type().lanes());
  }
  for (int i = 0; i < lanes; i++) {
    if (!condition) {
      print(values, e.args, first, i);
    } else {
      c.if_true(lane(c.e, condition, lanes_of(condition) == 1 ? 0 : i),
                [&] { print(values, e.args, first, i); });
    }
  }
  return values.of(e.args[first]);
}

}  // namespace retrograde::codegen
