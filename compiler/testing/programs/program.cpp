#include "testing/programs/program.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "graph/graph.h"
#include "testing/programs/maker.h"

namespace retrograde::fuzz {

namespace {

std::vector<Type> types(std::initializer_list<std::pair<Type, int>> weights) {
  std::vector<Type> result;
  for (const auto& [type, weight] : weights) result.insert(result.end(), weight, type);
  return result;
}

}  // namespace

Style Style::gradients() {
  Style s;
  s.parts = {{Structure::Stage, 100, 1, 4},  {Structure::Sines, 10, 4, 12}, {Structure::Volume, 8},
             {Structure::OfUsers, 45, 1, 2}, {Structure::Loop, 15},         {Structure::Ruled, 12}};
  s.image_types = types({{Float(32), 10}, {Float(64), 1}, {Float(16), 1}, {BFloat(16), 1}});
  s.value_types = types({{Float(32), 30},
                         {Float(64), 4},
                         {Float(16), 2},
                         {Int(32), 2},
                         {UInt(8), 1},
                         {BFloat(16), 1}});
  s.has_rules = true;
  return s;
}

Style Style::updates() {
  Style s;
  s.parts = {{Structure::Stage}};
  s.image_types = s.value_types = {Float(32)};
  s.dimensions = {2};
  s.least_updates = 1;
  s.self_reads = 40;
  return s;
}

Style Style::pieces() {
  Style s;
  s.parts = {{Structure::Piece, 100, 1, 6}};
  s.image_types = {Float(32)};
  s.has_exact_reads = true;
  return s;
}

Style Style::pipelines() {
  Style s;
  s.parts = {{Structure::Stencil, 20, 3, 7, true},
             {Structure::Stage, 100, 1, 5},
             {Structure::OfUsers, 5},
             {Structure::Loop, 2}};
  s.image_types = types({{UInt(8), 3},
                         {Int(8), 1},
                         {UInt(16), 2},
                         {Int(16), 2},
                         {Int(32), 3},
                         {UInt(32), 1},
                         {Int(64), 1},
                         {UInt(64), 1},
                         {Float(32), 3},
                         {Float(64), 1}});
  s.value_types = s.image_types;
  s.value_types.push_back(Bool());
  s.dimensions = {1, 2, 0, 1, 2, 2, 3};
  s.image_dimensions = 3;
  s.largest_image = 24;
  s.self_reads = 5;
  s.strides = 3;
  s.reads = 30;
  s.has_integers = s.has_runs = true;
  return s;
}

Style Style::chains() {
  Style s;
  s.parts = {{Structure::Link, 100, 5, 12}};
  s.image_types = s.value_types = {Int(32), Int(32), UInt(8)};
  s.dimensions = {1, 1, 2};
  s.image_dimensions = 2;
  s.strides = 3;
  s.has_integers = s.has_runs = true;
  return s;
}

void Maker::run() {
  make_inputs();
  for (const Part& part : s_.parts) {
    if (!c_.chance(part.percent)) continue;
    for (int n = c_.between(part.least, part.most); n > 0; --n) add(part.what);
    if (part.is_all) break;
  }
  if (s_.has_exact_reads) return end_pieces();
  add_output();
  p_.runs.push_back({main_region(0)});
  if (!s_.has_runs) return;
  if (p_.funcs.size() > 1 && c_.chance(25)) add_copy();
  for (int n = c_.chance(60) ? c_.between(1, 2) : 0; n > 0; --n) add_run();
}

void Maker::add(Structure what) {
  if (what == Structure::Stage) return add_func(c_.pick(s_.dimensions));
  if (what == Structure::Volume) return add_func(3);
  static constexpr void (Maker::*adds[])() = {nullptr,
                                              nullptr,
                                              &Maker::add_sine,
                                              &Maker::add_stencil,
                                              &Maker::add_loop,
                                              &Maker::add_custom,
                                              &Maker::add_structure,
                                              &Maker::add_piece,
                                              &Maker::add_link};
  (this->*adds[static_cast<size_t>(what)])();
}

// ---- regions ----

oracle::Region Maker::main_region(size_t output) {
  static const std::vector<std::vector<int>> largest = {{}, {70}, {36, 20}, {16, 10, 4}};
  const int dimensions = p_.outputs[output].dimensions();
  oracle::Region region;
  for (int d = 0; d < dimensions; ++d) {
    if (s_.has_runs) {
      const int most = largest[static_cast<size_t>(dimensions)][static_cast<size_t>(d)];
      region.extents.push_back(c_.between(1 + most / 4, most));
      region.mins.push_back(c_.chance(30) ? c_.around_zero(8) : 0);
    } else {
      region.mins.push_back(c_.chance(20) ? c_.around_zero(2) : 0);
      // Small extents, and odd ones that no vector divides.
      region.extents.push_back(c_.chance(10)   ? c_.between(1, 3)
                               : c_.chance(15) ? c_.between(7, 9)
                                               : natural_size);
    }
  }
  cover(output, region);
  return region;
}

// The region of an output must contain all accesses of its updates.
void Maker::cover(size_t output, oracle::Region& region) const {
  if (output > 0) return;  // a copy
  for (const auto& [d, low, high] : reaches_) {
    const int end = std::max(region.mins[d] + region.extents[d], high + 1);
    region.mins[d] = std::min(region.mins[d], low);
    region.extents[d] = end - region.mins[d];
  }
}

// Adds a copy as second output. A Func that the other output reads over a larger region cannot be an output itself.
void Maker::add_copy() {
  const Func source =
      p_.funcs[static_cast<size_t>(c_.below(static_cast<int>(p_.funcs.size()) - 1))];
  const std::vector<Var> vars = first_variables(source.dimensions());
  p_.outputs.push_back(define("copy", vars, source(vars).element(0)));
  p_.runs[0].push_back(main_region(1));
}

// Adds a run over a tiny or odd region at another position. Such sizes often decide which schedules are legal, so a
// program has few of them.
void Maker::add_run() {
  std::vector<oracle::Region> regions = p_.runs[0];
  for (size_t o = 0; o < regions.size(); ++o) {
    for (int& extent : regions[o].extents) extent = c_.pick(std::vector<int>{1, 1, 2, 3, 5, 7, 13});
    for (int& min : regions[o].mins) min = c_.chance(70) ? c_.around_zero(9) : 0;
    cover(o, regions[o]);
  }
  p_.runs.push_back(regions);
}

RandomProgram make_program(Choices& choices, const Style& style) {
  RandomProgram program;
  Maker(choices, program, style).run();
  return program;
}

std::vector<graph::FuncPtr> outputs_of(const RandomProgram& program) {
  return ir::mapped(program.outputs, [](const Func& f) -> graph::FuncPtr { return f.function(); });
}

std::string to_text(const RandomProgram& program, const ScheduleLog& schedule) {
  std::string result = graph::to_text(graph::graph_of(outputs_of(program)));
  if (schedule.size() > 0) result += "schedule\n" + schedule.to_text();
  for (const auto& run : program.runs) {
    for (size_t o = 0; o < run.size(); ++o) {
      result += "over";
      for (size_t d = 0; d < run[o].mins.size(); ++d)
        result += text(" [", run[o].mins[d], ", +", run[o].extents[d], ")");
      result += o + 1 < run.size() ? "," : "\n";
    }
  }
  return result;
}

}  // namespace retrograde::fuzz
