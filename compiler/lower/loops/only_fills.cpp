#include "lower/loops/only_fills.h"

#include "ir/visit.h"

namespace retrograde::lower {

bool only_fills(const Stmt& s, std::unordered_set<std::string> own) {
  const auto acts = [](const Expr& e) {
    const auto* call = e.as<Call>();
    return call &&
           (call->call_type != CallType::Operator || op_info(call->op).cls == OpClass::Effect);
  };
  return !any_node(s, acts, [&](const Stmt& part) {
    return match(
        part, [&](const Allocate& n) { return own.insert(n.name), false; },
        [&](const Store& n) { return !own.contains(n.name); },
        [&](const Free& n) { return !own.contains(n.name); }, [](const Block&) { return false; },
        [](const LetStmt&) { return false; }, [](const For&) { return false; },
        [](const IfThenElse&) { return false; }, [](const ProducerConsumer&) { return false; },
        [](const StmtNode&) { return true; });
  });
}

}  // namespace retrograde::lower
