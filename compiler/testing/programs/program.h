// program.h -- the generator of random programs: legal, small, and unusual in every respect.
//
//   RandomProgram p = make_program(choices, Style::gradients());  // the same choices: the same program
//
// Accesses: strides, divisions, remainders, clamps, diagonals, selects between indices, data-dependent indices,
// boundary conditions. Updates: partial, repeated, under predicates, over domains that are empty or start at odd
// indices; they read what they overwrite shifted, mirrored, strided and at data-dependent indices; loops over time.
// Values: branches that are NaN where they are not taken, ties, all types and casts between them, fast functions,
// Tuples with coupled components, inline reductions, undef. Extents may be parameters, or those of an ImageParam. A
// Style selects the structures, types and regions of a test.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/data/buffer.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"
#include "frontend/language/func.h"
#include "graph/directives/schedule_log.h"
#include "testing/array.h"
#include "testing/choices.h"

namespace retrograde::fuzz {

struct RandomProgram {
  std::vector<Buffer<>> images;
  std::vector<ImageParam>
      handles;  // one for each image, bound to it; undefined: the program reads the image itself
  Buffer<int> data;  // data-dependent indices
  Param<float> scale;
  Param<int> count;
  Param<uint8_t> narrow;
  std::vector<Func> funcs;  // in the order in which they were defined
  std::vector<Func> outputs;
  std::vector<std::vector<oracle::Region>> runs;  // for each output; the first run is the main one
  std::vector<Func> roots;         // Funcs computed at root if the program is not scheduled
  bool has_loop = false;           // has a loop over time
  bool has_rule = false;           // a custom rule for all inputs, which covers the Funcs between
  bool stops_gradients = false;    // second derivatives differ from those of the values
  bool has_stage = false;          // one Func may be replaced by an extern stage
  std::set<std::string> contents;  // of a workload, for statistics

  const Func& output() const { return outputs.front(); }
  const oracle::Region& region() const { return runs.front().front(); }
  AdjointInput image(size_t i) const {
    return i < handles.size() && handles[i].defined() ? AdjointInput(handles[i])
                                                      : AdjointInput(images[i]);
  }
};

enum class Structure : uint8_t {
  Stage,    // a Func of a random expression, and updates of it
  Volume,   // the same in three dimensions
  Sines,    // sine of the previous Func
  Stencil,  // stencil of the previous Func
  Loop,     // over time
  Ruled,    // with custom derivatives
  OfUsers,  // a structure of users' programs, over the last Func
  Piece,    // the same for images: it reads only elements that exist
  Link,     // reads the previous Funcs at another resolution
};

// How many of a structure, and in what percentage of programs.
struct Part {
  Structure what;
  int percent = 100, least = 1, most = 1;
  bool is_all = false;  // the last part
};

struct Style {
  std::vector<Part> parts;  // in their order
  std::vector<Type> image_types, value_types;
  std::vector<int> dimensions = {1, 2};  // of Funcs
  int image_dimensions = 2, largest_image = 7;
  int least_updates = 0;      // for each Func
  int self_reads = 35;        // percentage of an update's leaves
  int strides = 1 << 30;      // accesses of a program that enlarge the region read by a factor
  int reads = 1 << 30;        // image reads by an element of a Func if everything is inlined
  bool has_integers = false;  // integer operators; values are small, so none overflows
  bool has_rules = false;     // fast functions and custom derivatives
  bool has_runs = false;  // regions of many sizes, which contain all accesses of updates of outputs
  bool has_exact_reads = false;  // pieces only; images are read within their bounds, and up to them
  // Defines f as the sine of source by a C function.
  std::function<void(Func f, const Func& source)> extern_sine = {};

  static Style gradients();  // floats: stresses propagate_adjoints
  static Style updates();    // Funcs that overwrite themselves at random places
  static Style pieces();     // structures of image programs, at sizes that no vector divides
  static Style pipelines();  // all types and schedules: stresses the compiler
  static Style chains();     // five to twelve Funcs at changing resolution: for sliding windows
};

// The extent of each dimension that updates work on.
constexpr int natural_size = 5;

// Throws UserError if the program is illegal.
RandomProgram make_program(Choices& choices, const Style& style);

std::vector<graph::FuncPtr> outputs_of(const RandomProgram& program);

// The program as text for tools/opt: the graph, then the schedule, then the regions of each run.
std::string to_text(const RandomProgram& program, const ScheduleLog& schedule = {});

}  // namespace retrograde::fuzz
