#include "autodiff/explain.h"

#include "diagnostics/error.h"

namespace retrograde {

const char* to_string(Explanation::Kind kind) {
  switch (kind) {
    case Explanation::Kind::Built:
      return "built";
    case Explanation::Kind::Scattered:
      return "scattered";
    case Explanation::Kind::Privatised:
      return "privatised";
    case Explanation::Kind::Zero:
      return "zero";
    case Explanation::Kind::NotRequested:
      return "not requested";
    case Explanation::Kind::Version:
      return "version";
    case Explanation::Kind::Performance:
      return "performance";
    case Explanation::Kind::Stored:
      return "stored";
    case Explanation::Kind::Recomputed:
      return "recomputed";
    case Explanation::Kind::LeftOut:
      return "left out";
    case Explanation::Kind::Cost:
      return "cost";
    case Explanation::Kind::Custom:
      return "custom";
  }
  return "";
}

std::string to_string(const std::vector<Explanation>& explanations) {
  std::string out;
  for (const Explanation& e : explanations)
    out += text(to_string(e.kind), " ", quoted(e.subject), ": ", e.detail, "\n");
  return out;
}

}  // namespace retrograde
