// Machine code of arithmetic against the one definition of scalars, on random and extreme operands, in every type and
// in widths that fit the machine's vectors and widths that do not.
#include "unit/codegen_testing.h"

namespace retrograde::testing_codegen {
namespace {

const int widths[] = {1, 2, 3, 4, 5, 8, 12, 16, 20};

const Type number_types[] = {Int(8),    Int(16),   Int(32),   Int(64),   UInt(8),   UInt(16),
                             UInt(32),  UInt(64),  Float(16), BFloat(16), Float(32), Float(64)};

// out[i] = make(a[i], b[i] ...) for i in [0, count), `lanes` at a time.
using Make = std::function<Expr(const std::vector<Expr> &)>;
LoweredFunction elementwise(const std::vector<Type> &inputs, Type result, int lanes, int count, const Make &make) {
  LoweredFunction function;
  function.name = "elementwise";
  const Expr index = variable("i") * lanes;
  std::vector<Expr> operands;
  for (size_t k = 0; k < inputs.size(); k++) {
    const std::string name = "in" + std::to_string(k);
    function.args.push_back(input(name, inputs[k]));
    operands.push_back(make_load(inputs[k].with_lanes(lanes), name, lanes_at(index, lanes)));
  }
  function.args.push_back(output("out", result));
  const Stmt store = make_store("out", make(operands), lanes_at(index, lanes));
  function.body = make_for("i", 0, count / lanes, ForType::Serial, store);
  return function;
}

using Oracle = std::function<Scalar(const std::vector<Scalar> &)>;
void check(const std::string &what, const std::vector<Type> &inputs, Type result, int lanes, const Make &make,
           const Oracle &oracle, const Target &target = test_target()) {
  const int count = 240;  // divisible by all widths
  RandomScalars random(static_cast<uint32_t>(lanes));
  std::vector<std::unique_ptr<Array>> arrays;
  for (Type type : inputs) {
    arrays.push_back(std::make_unique<Array>(type, count));
    for (size_t i = 0; i < count; i++) arrays.back()->set(i, random(type));
  }
  arrays.push_back(std::make_unique<Array>(result, count));
  std::vector<Array *> raw;
  for (auto &array : arrays) raw.push_back(array.get());
  ASSERT_EQ(call(elementwise(inputs, result, lanes, count, make), raw, nullptr, target), 0) << what;
  for (size_t i = 0; i < count; i++) {
    std::vector<Scalar> operands;
    std::string text;
    for (size_t k = 0; k < inputs.size(); k++) {
      operands.push_back(arrays[k]->get(i));
      text += " " + show(operands.back());
    }
    const Scalar expected = oracle(operands), got = arrays.back()->get(i);
    ASSERT_TRUE(same(expected, got)) << what << " of" << text << " in " << lanes << " lanes: " << show(got)
                                     << ", expected " << show(expected);
  }
}

void check_binary(Kind kind, Type type, int lanes, const Target &target = test_target()) {
  const bool compares = kind >= Kind::EQ && kind <= Kind::GE;
  check(
      kind_name(kind), {type, type}, compares ? Bool() : type, lanes,
      [&](const std::vector<Expr> &args) { return binary(kind, args[0], args[1]); },
      [&](const std::vector<Scalar> &args) { return eval_binary(kind, args[0], args[1]); }, target);
}

TEST(CodegenArithmetic, BinaryOperatorsInEveryTypeAndWidth) {
  for (int lanes : widths) {
    for (Type type : number_types) {
      for (int kind = static_cast<int>(Kind::Add); kind <= static_cast<int>(Kind::GE); kind++) {
        check_binary(static_cast<Kind>(kind), type, lanes);
      }
    }
  }
}

}  // namespace
}  // namespace retrograde::testing_codegen
