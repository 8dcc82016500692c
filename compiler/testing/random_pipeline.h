// Random pipelines as plain data, so that a failing one can be printed and cut down.
//
// A PipelineSpec is built into Funcs by build_pipeline.h, scheduled by random_schedule.h, printed
// as C++ by print_program.h and shrunk by reducer.h. Every pipeline that the generator makes is
// legal and defined: indices that depend on data are clamped, images are read through boundary
// conditions or clamps, integers of 32 and 64 bits stay far from overflow, floats are clamped
// before they are converted to integers.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "ir/type.h"

namespace retrograde::fuzz {

class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed * 0x9e3779b97f4a7c15u + 1) {}
  int below(int n) { return static_cast<int>(engine_() % static_cast<uint64_t>(n)); }
  int between(int low, int high) { return low + below(high - low + 1); }
  bool chance(int percent) { return below(100) < percent; }
  template <typename T>
  const T& pick(const std::vector<T>& from) {
    return from[below(static_cast<int>(from.size()))];
  }

 private:
  std::mt19937_64 engine_;
};

enum class Action : uint8_t {
  // leaves
  Constant,   // value; floats: value / 8
  Variable,   // variable `source` of the definition, an int32
  Parameter,  // parameter `source`
  Image,      // image `source` at `indices`
  Func,       // value `element` of Func `source` at `indices`
  Self,       // value `element` of the Func being updated, at `indices`
  // one operand
  Cast,
  SaturatingCast,
  Not,
  Negate,
  Abs,
  Floor,
  Sqrt,
  Exp,
  Sin,
  // two operands of one type
  Add,
  Sub,
  Mul,
  Div,
  Mod,
  Min,
  Max,
  Absd,
  BitAnd,
  BitOr,
  BitXor,
  ShiftLeft,
  ShiftRight,
  Less,
  LessEqual,
  Equal,
  And,
  Or,
  // three
  Select,
  Clamp,
  Lerp,
  // over a reduction domain of its own: one operand
  Sum,
  Product,
  Maximum,
  Minimum,
  ArgMax,  // `element`: which coordinate of the place, or, past these, the value there
};

inline bool is_inline_reduction(Action action) { return action >= Action::Sum; }

struct Index;

struct ReductionRange {
  int min = 0, extent = 1;
};

struct Term {
  Action action = Action::Constant;
  Type type = Int(32);
  int64_t value = 0;
  int source = 0, element = 0;
  std::vector<Index> indices;
  std::vector<Term> operands;
  std::vector<ReductionRange> domain;  // of an inline reduction
};

// One coordinate of an access: scale * variable / divisor + offset, or data; then clamped.
struct Index {
  int variable = -1;  // -1: no variable
  int scale = 1, divisor = 1, offset = 0;
  bool clamped = false;
  int low = 0, high = 0;
  std::vector<Term> data;  // one int32 term, or none
};

// Variables of a definition: the dimensions 0 .. n-1, then its reduction variables, then those of
// the inline reduction that a term stands in.
struct UpdateSpec {
  std::vector<ReductionRange> domain;
  std::vector<Index> left;
  std::vector<Term> values;
  std::vector<Term> predicate;  // one bool term, or none
};

struct FuncSpec {
  int dimensions = 0;
  std::vector<Term> values;
  std::vector<UpdateSpec> updates;
};

enum class Boundary : uint8_t {
  Clamp,
  Constant,
  RepeatEdge,
  RepeatImage,
  MirrorImage,
  MirrorInterior
};

struct ImageSpec {
  Type type;
  std::vector<int> mins, extents;
  Boundary boundary = Boundary::Clamp;
  uint32_t seed = 0;
};

struct ParameterSpec {
  Type type;
  int64_t value = 0;  // floats: value / 8
};

struct OutputSpec {
  int func = 0;
  std::vector<int> mins, extents;
};

// One output's part of another run.
struct RegionSpec {
  std::vector<int> mins, extents;
};

struct PipelineSpec {
  std::vector<ImageSpec> images;
  std::vector<ParameterSpec> parameters;
  std::vector<FuncSpec> funcs;  // producers first
  std::vector<OutputSpec> outputs;
  // More regions to run over, each a list with one for each output: tiny, odd, elsewhere.
  std::vector<std::vector<RegionSpec>> sweep;
};

PipelineSpec random_pipeline(uint64_t seed);

// Calls f for every term below and including `term`, those in indices too.
template <typename T, typename F>
void for_each_term(T& term, const F& f) {
  f(term);
  for (auto& operand : term.operands) for_each_term(operand, f);
  for (auto& index : term.indices) {
    for (auto& data : index.data) for_each_term(data, f);
  }
}
// The same for all terms of a stage: 0 is the pure definition.
template <typename Spec, typename F>
void for_each_term_of_stage(Spec& func, int stage, const F& f) {
  if (stage == 0) {
    for (auto& term : func.values) for_each_term(term, f);
    return;
  }
  auto& update = func.updates[stage - 1];
  for (auto& term : update.values) for_each_term(term, f);
  for (auto& term : update.predicate) for_each_term(term, f);
  for (auto& index : update.left) {
    for (auto& data : index.data) for_each_term(data, f);
  }
}

// The regions of every run, the main one first.
std::vector<std::vector<OutputSpec>> all_runs(const PipelineSpec& pipeline);

// Funcs that the outputs need.
std::vector<bool> reachable_funcs(const PipelineSpec& pipeline);

}  // namespace retrograde::fuzz
