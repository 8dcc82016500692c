#include "codegen/device/nested_minima.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <set>
#include <string_view>
#include <vector>

namespace retrograde::codegen {
namespace {

using std::string_view;

string_view trimmed(string_view text) {
  const size_t begin = text.find_first_not_of(" \t"), end = text.find_last_not_of(" \t;");
  return begin == string_view::npos ? string_view() : text.substr(begin, end + 1 - begin);
}

// An instruction such as "min.s32 %r1, %r2, 5;" without surrounding blanks and semicolon. No operands: any other line.
struct Instruction {
  string_view name;
  std::vector<string_view> operands;
};

Instruction parsed(string_view line) {
  line = trimmed(line);
  const size_t end = line.find_first_of(" \t");
  if (end == string_view::npos || line[0] == '.' || line[0] == '@' || line[0] == '/') return {};
  Instruction result = {line.substr(0, end), {}};
  for (string_view rest = line.substr(end); !rest.empty();) {
    const size_t comma = std::min(rest.find(','), rest.size());
    result.operands.push_back(trimmed(rest.substr(0, comma)));
    rest.remove_prefix(std::min(comma + 1, rest.size()));
  }
  return result;
}

struct Kind {
  string_view name, bits, sign, unsigned_name;
};
constexpr std::array<Kind, 4> kinds = {{{"min.s32", "b32", "-2147483648", "min.u32"},
                                        {"max.s32", "b32", "-2147483648", "max.u32"},
                                        {"min.s16", "b16", "-32768", "min.u16"},
                                        {"max.s16", "b16", "-32768", "max.u16"}}};

bool is_of(const Instruction& instruction, const Kind& kind) {
  return instruction.name == kind.name && instruction.operands.size() == 3;
}

// The registers of a function that may hold the result of such an instruction, also after copies: ptxas unrolls loops,
// in which a copy carries one iteration's minimum to the next.
std::set<string_view> results_of(const Kind& kind, const std::vector<Instruction>& function) {
  std::set<string_view> registers;
  for (size_t before = size_t(-1); before != registers.size();) {
    before = registers.size();
    for (const Instruction& one : function) {
      const bool is_copy = one.name.substr(0, 4) == "mov." && one.operands.size() == 2 &&
                           registers.count(one.operands[1]) > 0;
      if (is_copy || is_of(one, kind)) registers.insert(one.operands[0]);
    }
  }
  return registers;
}

void add_unsigned(const Instruction& one, const Kind& kind, std::string& out) {
  const auto line = [&](std::initializer_list<string_view> parts) {
    out += "\t";
    for (const string_view part : parts) out += part;
    out += ";\n";
  };
  out += "\t{\n";
  line({".reg .", kind.bits, " %part_a, %part_b"});
  line({"mov.", kind.bits, " %part_a, ", one.operands[1]});
  line({"mov.", kind.bits, " %part_b, ", one.operands[2]});
  line({"xor.", kind.bits, " %part_a, %part_a, ", kind.sign});
  line({"xor.", kind.bits, " %part_b, %part_b, ", kind.sign});
  line({kind.unsigned_name, " %part_a, %part_a, %part_b"});
  line({"xor.", kind.bits, " ", one.operands[0], ", %part_a, ", kind.sign});
  out += "\t}\n";
}

void add_function(const std::vector<string_view>& lines, std::string& out) {
  std::vector<Instruction> function;
  for (const string_view line : lines) function.push_back(parsed(line));
  std::array<std::set<string_view>, kinds.size()> results;
  for (size_t k = 0; k < kinds.size(); ++k) results[k] = results_of(kinds[k], function);
  for (size_t i = 0; i < lines.size(); ++i) {
    const Instruction& one = function[i];
    bool is_rewritten = false;
    for (size_t k = 0; k < kinds.size() && !is_rewritten; ++k) {
      is_rewritten = is_of(one, kinds[k]) && (results[k].count(one.operands[1]) > 0 ||
                                              results[k].count(one.operands[2]) > 0);
      if (is_rewritten) add_unsigned(one, kinds[k], out);
    }
    if (!is_rewritten) out.append(lines[i]).append("\n");
  }
}

}  // namespace

std::string rewrite_nested_minima(const std::string& ptx) {
  std::string out;
  std::vector<string_view> function;
  for (string_view rest = ptx; !rest.empty();) {
    const size_t end = std::min(rest.find('\n'), rest.size());
    function.push_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    // LLVM ends each function with a "}" at the beginning of a line, and no other line is just that.
    if (function.back() != "}" && !rest.empty()) continue;
    add_function(function, out);
    function.clear();
  }
  return out;
}

}  // namespace retrograde::codegen
