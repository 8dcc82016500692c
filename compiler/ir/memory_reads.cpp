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
  return any_node(
      e, [](const Load&) { return true; }, [&](const Call& call) { return kind_of(call) <= what; });
}

bool calls(const Expr& e, const Symbol* f) {
  return any_node(e, [&](const Call& call) { return call.symbol.raw() == f; });
}

}  // namespace retrograde::ir
