#include "autodiff/report/explain.h"

#include <algorithm>
#include <map>
#include <regex>
#include <set>

#include "diagnostics/error.h"
#include "graph/names.h"

namespace retrograde {

namespace {

using ExplanationKind = Explanation::Kind;

constexpr size_t most_names = 8;  // listed for each kind in a summary

// The order of a summary: what users ask first comes first.
constexpr ExplanationKind told_first[] = {
    ExplanationKind::Cost,    ExplanationKind::Stored,       ExplanationKind::Recomputed,
    ExplanationKind::Version, ExplanationKind::Scattered,    ExplanationKind::Privatised,
    ExplanationKind::Zero,    ExplanationKind::NotRequested, ExplanationKind::LeftOut,
    ExplanationKind::Custom,  ExplanationKind::Built,        ExplanationKind::Performance};

std::string line_of(const Explanation& e) {
  return text(to_string(e.kind), " ", quoted(e.subject), ": ", e.detail, "\n");
}

// The facts of one kind, the largest first, each subject once.
std::vector<Explanation> of_kind(const std::vector<Explanation>& all, ExplanationKind kind) {
  std::vector<Explanation> found;
  std::set<std::string> seen;
  for (const Explanation& e : all) {
    if (e.kind == kind && seen.insert(e.subject).second) found.push_back(e);
  }
  std::ranges::stable_sort(
      found, [](const Explanation& a, const Explanation& b) { return a.bytes > b.bytes; });
  return found;
}

std::string subject_of(const Explanation& e) {
  if (e.bytes == 0) return quoted(e.subject);
  return text(quoted(e.subject), " (", static_cast<int64_t>(e.bytes), " bytes)");
}

std::string line_of(const char* what, const std::vector<Explanation>& facts) {
  if (facts.empty()) return "";
  std::string result = text(what, " (", facts.size(), "): ");
  for (size_t i = 0; i < std::min(facts.size(), most_names); ++i)
    result += (i > 0 ? ", " : "") + subject_of(facts[i]);
  if (facts.size() > most_names) result += text(" and ", facts.size() - most_names, " more");
  return result + "\n";
}

// An adjoint that is built may still have contributions that are zero; it is listed as zero in part.
std::string zeros_of(const std::vector<Explanation>& all) {
  std::set<std::string> built;
  for (const Explanation& e : of_kind(all, ExplanationKind::Built)) built.insert(e.subject);
  std::vector<Explanation> entirely, in_part;
  for (const Explanation& e : of_kind(all, ExplanationKind::Zero))
    (built.count(e.subject) ? in_part : entirely).push_back(e);
  return line_of("zero", entirely) + line_of("zero in part", in_part);
}

std::string summary_of(const std::vector<Explanation>& all, ExplanationKind kind) {
  if (kind == ExplanationKind::Zero) return zeros_of(all);
  const std::vector<Explanation> facts = of_kind(all, kind);
  if (kind == ExplanationKind::Cost && !facts.empty()) return line_of(facts.front());
  return line_of(to_string(kind), facts);
}

std::string summary_of(const std::vector<Explanation>& all) {
  std::string result;
  for (ExplanationKind kind : told_first) result += summary_of(all, kind);
  return result + "explain(Detail::All) lists every fact with its reason.\n";
}

// Drops the numbers of quoted names where the short names stay distinct.
std::string with_short_names(const std::string& words) {
  static const std::regex name("\"[^\"\n]*\"");
  std::map<std::string, std::set<std::string>> alike;
  for (auto i = std::sregex_iterator(words.begin(), words.end(), name); i != std::sregex_iterator();
       ++i)
    alike[graph::without_numbers(i->str())].insert(i->str());
  std::string result;
  auto copied = words.cbegin();
  for (auto i = std::sregex_iterator(words.begin(), words.end(), name); i != std::sregex_iterator();
       ++i) {
    const std::string shorter = graph::without_numbers(i->str());
    result.append(copied, words.cbegin() + i->position());
    result += alike[shorter].size() == 1 ? shorter : i->str();
    copied = words.cbegin() + i->position() + i->length();
  }
  return result.append(copied, words.cend());
}

}  // namespace

const char* to_string(Explanation::Kind kind) {
  static constexpr const char* words[] = {"built",         "scattered", "privatised",  "zero",
                                          "not requested", "version",   "performance", "stored",
                                          "recomputed",    "left out",  "cost",        "custom"};
  return words[static_cast<int>(kind)];
}

std::string to_string(const std::vector<Explanation>& explanations, Detail detail) {
  if (detail == Detail::Summary) return with_short_names(summary_of(explanations));
  std::string out;
  for (const Explanation& e : explanations) out += line_of(e);
  return with_short_names(out);
}

}  // namespace retrograde
