// plan_text.h -- the words of the text form of plans, which the printer and the parser share.
//
//   out   root  parallel y:8 GuardWithIf, y, x:16, vector x
//   blur  at out/y:8  store root  heap  (y, x)  fold y by 4
//     .0  vector x:16, x
//     .1  shared with blur.0/y  atomic  r.x, (x:16 y):4, unroll (x:16 y), vector x
//
// A line without loops has those of the definition, and a line without a list of dimensions stores them in their order.
// `x:4*8` is a step of 32 points in blocks of 8, `x%8` a loop over remainders.
#pragma once

#include <string>
#include <vector>

#include "autoschedule/plan/plan.h"

namespace retrograde::planning {

const char* kind_word(ForType kind);  // empty for a serial loop
const char* concurrency_word(Concurrency concurrency);
// Finds the enumerator that a word stands for; returns false when there is none.
bool read_kind(const std::string& word, ForType& kind);
bool read_concurrency(const std::string& word, Concurrency& concurrency);
bool read_tail(const std::string& word, TailStrategy& tail);
bool read_align(const std::string& word, LoopAlignStrategy& align);
bool read_memory(const std::string& word, MemoryType& memory);
bool read_opacity(const std::string& word, Opacity& opacity);

inline constexpr const char* once_word = "once";
// The name, in back quotes when it is a word of plans.
std::string name_text(const std::string& name);

// The loops of a stage as text.
class LoopText {
 public:
  // The nest is not copied.
  LoopText(const graph::FuncContents& f, int stage, const Nest& nest);
  // The loop as others refer to it: without its kind and tail.
  std::string place(size_t depth) const;
  std::string loop(size_t depth) const;

 private:
  const Nest& nest_;
  const std::vector<std::string> iterators_;

  std::string base(int iterator) const;
  std::string steps(const Part& part) const;
  std::string part(const Part& part) const;
};

// The loops of a stage that no plan describes, by their names.
std::string opaque_place(const graph::FuncContents& f, int stage, int depth);

}  // namespace retrograde::planning
