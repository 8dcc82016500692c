#include "lower/loops/choice_arms.h"

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::lower {

// The value of the variable for which a select takes its first arm; nullopt if its condition is not about the variable.
std::optional<int64_t> ChoiceArms::case_of(const Expr& e) const {
  const auto* select = e.as<Select>();
  if (!select || select->condition.kind() != Kind::EQ) return std::nullopt;
  const auto* equality = select->condition.as<Binary>();
  const auto* variable = equality->a.as<Variable>();
  return variable && variable->name == variable_ ? as_const_int(equality->b) : std::nullopt;
}

bool ChoiceArms::has_any(const Stmt& s) const {
  return any_node(
      s, [&](const Expr& e) { return case_of(e).has_value(); }, [](const Stmt&) { return false; });
}

ChoiceArms::Table ChoiceArms::table_of(const Expr& choice) const {
  Table table;
  table.otherwise = choice;
  while (const auto value = case_of(table.otherwise)) {
    const Expr select = table.otherwise;
    table.arms.emplace(*value, select.as<Select>()->when_true);  // the first arm for a value wins
    table.otherwise = select.as<Select>()->when_false;
  }
  return table;
}

// The result for a value of the chain of selects that begins with e; undefined if e is not such a select.
Expr ChoiceArms::arm(const Expr& e, int64_t value) {
  if (!case_of(e)) return {};
  auto found = tables_.find(e.get());
  if (found == tables_.end()) found = tables_.emplace(e.get(), table_of(e)).first;
  const Table& table = found->second;
  return value_or(table.arms, value, table.otherwise);
}

Stmt ChoiceArms::choose(const Stmt& body, int64_t value) {
  return rewrite(body, [&](const Expr& e, const auto& recurse) { return recurse(arm(e, value)); });
}

}  // namespace retrograde::lower
