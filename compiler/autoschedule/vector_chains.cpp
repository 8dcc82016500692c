#include "autoschedule/vector_chains.h"

#include <algorithm>
#include <unordered_map>

#include "autoschedule/cost_estimate.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/machine/reference.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

using planning::core;

// Chains are never as dense as the estimate: so many fill their gaps.
constexpr double gaps = 1.5;
constexpr double least_wanted = 0.38;  // for each vector
constexpr double least_instructions = 100,
                 most_instructions = 2000;  // of a body, of all its vectors

// The body of a loop along one variable.
class Body {
 public:
  explicit Body(std::string variable) : variable_(std::move(variable)) {}

  void add(const Expr& value) { longest_chain_ = std::max(longest_chain_, visit(value).ready); }

  double instructions() const { return instructions_; }
  // The shortest time of an iteration, and that of its longest chain.
  double cycles() const { return cycles_; }
  double longest_chain() const { return longest_chain_; }

 private:
  struct Node {
    bool varies = false;  // along the variable
    double ready = 0;     // cycles after its iteration begins
  };

  Node visit(const Expr& e) {
    const auto found = known_.find(e.get());
    if (found != known_.end()) return found->second;
    Node node;
    if (const auto* v = e.as<Variable>()) node.varies = v->name == variable_;
    const bool is_sum = e.kind() == Kind::Add || e.kind() == Kind::Sub;
    bool is_fused = false;
    for_each_child(e, [&](const Expr& child) {
      const Node operand = visit(child);
      // A product that is added is part of the addition.
      const bool is_product = is_sum && child.kind() == Kind::Mul && operand.varies;
      is_fused |= is_product;
      node.varies |= operand.varies;
      node.ready = std::max(node.ready, operand.ready - (is_product ? core.float_latency : 0));
    });
    if (node.varies) add_operation(e, node, is_fused);
    known_.emplace(e.get(), node);
    return node;
  }

  void add_operation(const Expr& e, Node& node, bool is_fused) {
    const auto* call = e.as<Call>();
    const bool is_read = call && call->call_type != CallType::Operator;
    const double operations = operations_of(e), function = work_of(e).function_adds;
    double latency = is_read          ? core.load_latency
                     : operations > 0 ? core.float_latency
                                      : 0,
           cycles = operations;
    if (e.kind() == Kind::Div && e.type().is_float())
      latency = core.divide_latency, cycles = core.divide_cycles;
    else if (call && call->is_op(Op::sqrt))
      latency = core.sqrt_latency, cycles = core.sqrt_cycles;
    else if (function > 0)
      latency = core.function_latency * function;
    node.ready += latency;
    cycles_ += is_fused ? 0 : cycles;
    instructions_ += is_fused ? 0 : function > 0 ? operations : std::min(operations, 1.0);
  }

  const std::string variable_;
  std::unordered_map<const ExprNode*, Node> known_;
  double instructions_ = 0, cycles_ = 0, longest_chain_ = 0;
};

}  // namespace

int vectors_side_by_side(const FuncContents& f) {
  if (!f.is_pure() || f.is_extern() || f.args.empty()) return 1;
  const std::vector<Expr> roots = roots_with_inlined(*f.pure);
  if (std::ranges::any_of(roots, [](const Expr& e) { return e.defined() && e.type().bits() > 32; }))
    return 1;
  Body body(f.args[0]);
  for (const Expr& root : roots) body.add(root);
  if (body.instructions() < least_instructions) return 1;
  const double wanted = gaps * body.longest_chain() / std::max(body.cycles(), 1.0) -
                        core.reorder_window / body.instructions();
  for (const int vectors : {4, 2}) {
    if (wanted > least_wanted * vectors && body.instructions() * vectors <= most_instructions)
      return vectors;
  }
  return 1;
}

}  // namespace retrograde::autoschedule
