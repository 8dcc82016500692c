#include "autoschedule/cost/stage_facts.h"

#include <algorithm>
#include <cmath>

#include "autoschedule/cost/assumptions.h"
#include "ir/operators.h"

namespace retrograde::planning {

namespace {

// The iterators of a recurrence: those that move an index in which the read differs from the write, also inside of clamps.
IteratorSet carried_by(const Access& read, const Access& write) {
  IteratorSet result = 0;
  for (size_t d = 0; d < read.index.size(); ++d) {
    const IndexForm &from = read.index[d], &to = write.index[d];
    const bool is_same = from.same_parts(to) && from.low == to.low && from.high == to.high;
    if (!is_same) result |= from.moved_by() | to.moved_by();
  }
  return result;
}

// Operations that depend on the same iterators. Products that are added are one operation with the sum.
class OperationTable {
 public:
  void add(const OperationCount& operation, IteratorSet depends, IteratorSet decided_by) {
    // Products that ignore infinite factors of 0 are tried as plain ones first.
    const std::string name = operation.name == "strong_mul"   ? "Mul"
                             : operation.name == "strong_div" ? "Div"
                                                              : operation.name;
    const Op op = op_from_name(name);
    const bool is_function = op != Op::none && op_info(op).work.functions > 0;
    rows_[{name, operation.type, depends, operation.in_arm && is_function, decided_by}] +=
        operation.count;
  }
  std::vector<OperationRow> rows(const Machine& machine) {
    for (auto& [key, count] : rows_) {
      const auto& [name, type, depends, behind_branch, decided_by] = key;
      if (name == "Mul" && type.is_float())
        count -= std::min(count, count_of("Add", type, depends) + count_of("Sub", type, depends));
    }
    std::vector<OperationRow> result;
    for (const auto& [key, count] : rows_) {
      const auto& [name, type, depends, behind_branch, decided_by] = key;
      if (count > 0)
        result.push_back({operation_time(name, type, machine), static_cast<double>(type.bytes()),
                          depends, count, behind_branch, decided_by});
    }
    return result;
  }

 private:
  std::map<std::tuple<std::string, Type, IteratorSet, bool, IteratorSet>, double> rows_;

  double count_of(const char* name, Type type, IteratorSet depends) const {
    return ir::value_or(rows_, {name, type, depends, false, 0}, 0.0);
  }
};

}  // namespace

FactsOfStages::FactsOfStages(const SizeModel& sizes, const Machine& machine)
    : graph_(sizes.graph()),
      sizes_(sizes),
      machine_(machine),
      motions_(graph_),
      composer_(graph_, most_composed_reads) {}

const StageFacts& FactsOfStages::of(StageId stage, const std::vector<FuncId>& inlined) {
  std::pair key{stage, inlined};
  if (const StageFacts* found = ir::find_or_null(known_, key)) return *found;
  return known_.emplace(std::move(key), find(graph_.stage(stage), inlined)).first->second;
}

StageFacts FactsOfStages::find(const StageNode& stage, const std::vector<FuncId>& inlined) {
  const auto composed = composer_.compose(
      stage, [&](FuncId func) { return std::ranges::binary_search(inlined, func); });
  StageFacts facts;
  facts.touches = touches(stage, composed.reads);
  facts.operations = operations(stage, composed);
  facts.taken =
      stage.guard.fraction() * std::pow(taken_branches, double(stage.guard.others.size()));
  return facts;
}

std::vector<Touch> FactsOfStages::touches(const StageNode& stage,
                                          const std::vector<Access>& reads) const {
  std::vector<const Access*> others{&stage.write};
  std::vector<Touch> own;
  for (const Access& read : reads) {
    if (read.of != stage.id.func) {
      others.push_back(&read);
      continue;
    }
    Touch touch = touches_of({&read}, sizes_, motions_)[0];
    touch.carried = carried_by(read, stage.write);
    touch.is_own = touch.carried == 0;
    own.push_back(std::move(touch));
  }
  std::vector<Touch> result = touches_of(others, sizes_, motions_);
  ir::append(result, own);
  return result;
}

std::vector<OperationRow> FactsOfStages::operations(const StageNode& stage,
                                                    const ReadComposer::Composed& composed) const {
  OperationTable table;
  for (const OperationCount& operation : stage.operations)
    table.add(operation, operation.depends, operation.decided_by);
  for (const auto& [func, elements] : composed.elements) {
    const StageNode& inlined = graph_.func(func).stages[0];
    for (const Access& element : elements) {
      for (const OperationCount& operation : inlined.operations) {
        const auto moved_by = [&](IteratorSet dimensions) {
          IteratorSet result = 0;
          for (size_t d = 0; d < element.index.size(); ++d)
            if (dimensions & set_of(static_cast<int>(d))) result |= element.index[d].moved_by();
          return result;
        };
        table.add(operation, moved_by(operation.depends), moved_by(operation.decided_by));
      }
    }
  }
  return table.rows(machine_);
}

}  // namespace retrograde::planning
