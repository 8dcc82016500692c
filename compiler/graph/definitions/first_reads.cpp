#include "graph/definitions/first_reads.h"

#include <algorithm>
#include <unordered_set>

#include "ir/walk_once.h"

namespace retrograde::graph {

namespace {

thread_local FirstReadsMemo* innermost_memo = nullptr;

std::vector<Expr> roots_of(const FuncContents& f) {
  std::vector<Expr> roots;
  for_each_expr(f, [&](const Expr& root) { roots.push_back(root); });
  return roots;
}

bool are_same(const std::vector<Expr>& a, const std::vector<Expr>& b) {
  return std::ranges::equal(a, b, [](const Expr& x, const Expr& y) { return x.same_as(y); });
}

std::vector<const Call*> find_reads(const std::vector<Expr>& roots) {
  std::vector<const Call*> reads;
  std::unordered_set<const Symbol*> seen;
  NodeSet visited;
  for (const Expr& root : roots) {
    walk_once(root, visited, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      const bool reads_element =
          call && (call->call_type == CallType::Func || call->call_type == CallType::Image);
      if (reads_element && seen.insert(call->symbol.raw()).second) reads.push_back(call);
      return true;
    });
  }
  return reads;
}

}  // namespace

FirstReadsMemo::FirstReadsMemo() : outer_(innermost_memo) { innermost_memo = this; }
FirstReadsMemo::~FirstReadsMemo() { innermost_memo = outer_; }

std::vector<const Call*> first_reads(const FuncContents& f) {
  std::vector<Expr> roots = roots_of(f);
  if (!innermost_memo) return find_reads(roots);
  FirstReadsMemo::Entry& entry = innermost_memo->entries_[&f];
  if (!are_same(entry.roots, roots)) {
    entry.reads = find_reads(roots);
    entry.roots = std::move(roots);
  }
  return entry.reads;
}

}  // namespace retrograde::graph
