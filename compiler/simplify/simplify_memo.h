// simplify_memo.h -- results of simplify() that are remembered.
#pragma once

#include <memory>

namespace retrograde::simplification {

class Simplifier;

// While it lives, simplify() without bounds remembers its results in this thread, and can_prove() does. A pass that grows
// expressions step by step, and simplifies each step, then takes time for what is new in a step only.
class SimplifyMemo {
 public:
  SimplifyMemo();
  ~SimplifyMemo();
  SimplifyMemo(const SimplifyMemo&) = delete;
  SimplifyMemo& operator=(const SimplifyMemo&) = delete;

  static SimplifyMemo* innermost();
  Simplifier& simplifier() { return *simplifier_; }

 private:
  const std::unique_ptr<Simplifier> simplifier_;
  SimplifyMemo* const outer_;
};

}  // namespace retrograde::simplification
