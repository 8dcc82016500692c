#include "gradient/adversary/tally.h"

#include <algorithm>
#include <sstream>
#include <vector>

namespace retrograde::gradient {

namespace {

constexpr size_t most_reasons = 12;

// Between quotes and of digits nothing is left.
std::string without_names(const std::string& message) {
  std::string result;
  bool quoted = false;
  for (char c : message) {
    if (c == '"') quoted = !quoted;
    if (!quoted && c != '"' && !(c >= '0' && c <= '9')) result += c;
  }
  return result;
}

}  // namespace

// "cannot do A: the rule B; the evidence C. Do D": what stands between ": " and "; ".
std::string reason_of(const std::string& message) {
  const std::string plain = without_names(message);
  const bool is_compiled = plain.find("no machine code") != std::string::npos;
  size_t begin = plain.find(": ");
  if (is_compiled && begin != std::string::npos) begin = plain.find(": ", begin + 2);
  const size_t end = plain.find("; ", begin == std::string::npos ? 0 : begin);
  const std::string rule =
      begin == std::string::npos ? plain : plain.substr(begin + 2, end - begin - 2);
  return (is_compiled ? "machine code: " : "") + rule.substr(0, 110);
}

void Tally::add(const Judged& judged) {
  ++tried_;
  ++judgements_[judged.judgement];
  for (unsigned bit : {HigherOrders, DenseMatrices, MachineCode}) {
    if (judged.checked & bit) ++checked_[bit];
  }
  if (judged.judgement == Judgement::Refused) ++reasons_[reason_of(judged.detail)];
}

uint64_t Tally::count(Judgement judgement) const {
  const auto it = judgements_.find(judgement);
  return it == judgements_.end() ? 0 : it->second;
}

bool Tally::refuses_much() const {
  return tried_ >= 50 && 3 * count(Judgement::Refused) > tried_ - count(Judgement::Illegal);
}

std::string Tally::summary(double seconds) const {
  std::ostringstream out;
  out << tried_ << " programs, " << found_ << " findings";
  for (const auto& [judgement, n] : judgements_) out << ", " << n << " " << name_of(judgement);
  const std::map<unsigned, const char*> names = {{HigherOrders, "with higher derivatives"},
                                                 {DenseMatrices, "with dense matrices"},
                                                 {MachineCode, "as machine code"}};
  for (const auto& [bit, n] : checked_) out << ", " << n << " " << names.at(bit);
  out << ", " << static_cast<uint64_t>(seconds) << " seconds\n";
  std::vector<std::pair<uint64_t, std::string>> reasons;
  for (const auto& [reason, n] : reasons_) reasons.emplace_back(n, reason);
  std::sort(reasons.rbegin(), reasons.rend());
  if (reasons.size() > most_reasons) reasons.resize(most_reasons);
  for (const auto& [n, reason] : reasons) out << "  " << n << " refused: " << reason << "\n";
  return out.str();
}

}  // namespace retrograde::gradient
