#include "ir/memory_reads.h"

#include "ir/visit.h"

namespace retrograde::ir {

namespace {

MemoryReads kind_of(const Call& call) {
  switch (call.call_type) {
    case CallType::Func:
    case CallType::Image:
      return MemoryReads::Storage;
    case CallType::Extern:
      return MemoryReads::Functions;
    case CallType::Operator:
      return MemoryReads::Calls;
  }
  return MemoryReads::Functions;
}

}  // namespace

bool reads_memory(const Expr& e, MemoryReads what) {
  return any_node(e, [&](const Expr& node) {
    const auto* call = node.as<Call>();
    return node.kind() == Kind::Load || (call && kind_of(*call) <= what);
  });
}

bool calls(const Expr& e, const Symbol* f) {
  return any_node(e, [&](const Expr& node) {
    const auto* call = node.as<Call>();
    return call && call->symbol.raw() == f;
  });
}

}  // namespace retrograde::ir
