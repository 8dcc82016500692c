// Writes the function as a stream of numbers. Every expression node gets a number after its children and is written
// once, as its kind, its contents and its children's numbers; so shared nodes cost nothing. Names are numbered by first
// appearance.
#include "jit/fingerprint.h"

#include <bit>
#include <string>
#include <unordered_map>

#include "ir/visit.h"

namespace retrograde::jit {

using namespace ir;

void Fingerprint::add(uint64_t word) {
  low = (low ^ word) * 0x9fb21c651e98df25u;
  low ^= low >> 32;
  high = (std::rotl(high, 23) + word) * 0xd6e8feb86659fd93u;
  high ^= high >> 29;
}

void Fingerprint::add(std::string_view text) {
  add(text.size());
  for (char c : text) add(static_cast<unsigned char>(c));
}

namespace {

struct Words {
  std::string bytes;
  void add(uint64_t word) { bytes.append(reinterpret_cast<const char*>(&word), sizeof word); }
  void add(std::string_view text) {
    add(text.size());
    bytes += text;
  }
};

// Writes into a Fingerprint or into Words.
template <typename Result>
class Writer {
 public:
  explicit Writer(const LoweredFunction& function) {
    for (const LoweredArgument& arg : function.args) {
      add(static_cast<uint64_t>(arg.kind), arg.type.key(), static_cast<uint64_t>(arg.dimensions),
          name(arg.name));
      if (arg.is_buffer()) add(name(arg.name + ".buffer"));
    }
    if (function.body.defined()) write(function.body);
  }
  Result result;

 private:
  template <typename... Words>
  void add(Words... words) {
    (result.add(static_cast<uint64_t>(words)), ...);
  }

  uint64_t name(const std::string& text) {
    return names_.emplace(text, names_.size()).first->second;
  }

  uint64_t number(const Expr& e) {
    if (const auto* found = ir::find_or_null(numbers_, e.get())) return *found;
    std::vector<uint64_t> children;
    for_each_child(e, [&](const Expr& child) { children.push_back(number(child)); });
    add(e.kind(), e.type().key());
    write_contents(e);
    for (uint64_t child : children) add(child);
    return numbers_.emplace(e.get(), numbers_.size()).first->second;
  }

  void write_contents(const Expr& e) {
    match(
        e, [&](const IntImm& n) { add(n.value); }, [&](const UIntImm& n) { add(n.value); },
        [&](const FloatImm& n) { add(std::bit_cast<uint64_t>(n.value)); },
        [&](const StringImm& n) { result.add(n.value); },
        [&](const Variable& n) { add(name(n.name)); },
        [&](const Load& n) { add(name(n.name), n.predicate.defined()); },
        [&](const Ramp& n) { add(n.lanes); }, [&](const Broadcast& n) { add(n.lanes); },
        [&](const Let& n) { add(name(n.name)); }, [&](const VectorReduce& n) { add(n.op); },
        [&](const Shuffle& n) {
          add(n.indices.size());
          for (int index : n.indices) add(index);
        },
        [&](const Call& n) {
          add(n.call_type, n.op, n.args.size(), n.component);
          result.add(n.call_type == CallType::Operator ? std::string() : n.name);
        },
        [](const ExprNode&) {});
  }

  void write(const Stmt& s) {
    std::vector<uint64_t> expressions;
    std::vector<Stmt> parts;
    for_each_child(
        s, [&](const Expr& child) { expressions.push_back(number(child)); },
        [&](const Stmt& part) { parts.push_back(part); });
    add(s.kind(), expressions.size(), parts.size());
    write_contents(s);
    for (uint64_t expression : expressions) add(expression);
    for (const Stmt& part : parts) write(part);
  }

  void write_contents(const Stmt& s) {
    match(
        s, [&](const LetStmt& n) { add(name(n.name)); },
        [&](const For& n) { add(name(n.name), n.runs); },
        [&](const Store& n) { add(name(n.name), n.predicate.defined()); },
        [&](const Allocate& n) {
          add(name(n.name), n.type.key(), n.memory);
          result.add(n.name.substr(0, n.name.find('$')));  // appears in error messages
        },
        [&](const Free& n) { add(name(n.name)); }, [&](const Atomic& n) { add(name(n.name)); },
        [](const StmtNode&) {});
  }

  std::unordered_map<std::string, uint64_t> names_;
  std::unordered_map<const ExprNode*, uint64_t> numbers_;
};

}  // namespace

Fingerprint fingerprint(const LoweredFunction& function) {
  return Writer<Fingerprint>(function).result;
}

std::string fingerprint_text(const LoweredFunction& function) {
  return std::move(Writer<Words>(function).result.bytes);
}

}  // namespace retrograde::jit
