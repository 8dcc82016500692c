// Random programs: legal, small, and odd in every way at once. The one generator of them.
//
//   RandomProgram p = make_program(choices, Style::gradients());  // the same choices: the same program
//
// Accesses: strides, divisions, remainders, clamps, diagonals, choices between indices, places that
// data decide, boundary conditions. Updates: partial, repeated, under predicates, over domains with
// odd starts and empty ones, reading what they overwrite shifted, mirrored, strided and at places
// of data; loops over time. Values: branches that are NaN where they are not taken, ties, all types
// and casts between them, fast functions, Tuples with coupled components, inline reductions, undef.
// Extents may be parameters, or those of an ImageParam. A Style says which structures a test asks
// for, of what types, and over what regions.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/data/buffer.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"
#include "frontend/language/func.h"
#include "graph/schedule_log.h"
#include "testing/array.h"
#include "testing/choices.h"

namespace retrograde::fuzz {

struct RandomProgram {
  std::vector<Buffer<>> images;
  std::vector<ImageParam> handles;  // one for each image, which holds it; undefined: named itself
  Buffer<int> data;                 // places
  Param<float> scale;
  Param<int> count;
  Param<uint8_t> narrow;
  std::vector<Func> funcs;  // in the order in which they were defined
  std::vector<Func> outputs;
  std::vector<std::vector<oracle::Region>> runs;  // of each output; the first run is the main one
  std::vector<Func> roots;                        // to be computed at root, if nobody schedules it
  bool has_loop = false;                          // over time
  bool has_rule = false;         // of all inputs: what lies between them is the rule's own
  bool stops_gradients = false;  // derivatives of derivatives are not those of the values
  bool has_stage = false;        // one Func may be an extern stage instead

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
  Sines,    // of the Func before it
  Stencil,  // the same, of its neighbours
  Loop,     // over time
  Ruled,    // with derivatives that the author writes
  OfUsers,  // what programs of users are made of, over the last Func
  Piece,    // the same of images: it reads no more than what is there
  Link,     // reads the Funcs before it at another resolution
};

// So many of a structure, in so many programs of a hundred.
struct Part {
  Structure what;
  int percent = 100, least = 1, most = 1;
  bool is_all = false;  // nothing comes after it
};

struct Style {
  std::vector<Part> parts;  // in their order
  std::vector<Type> image_types, value_types;
  std::vector<int> dimensions = {1, 2};  // of Funcs
  int image_dimensions = 2, largest_image = 7;
  int least_updates = 0;      // of a Func
  int self_reads = 35;        // of a hundred leaves of an update
  int strides = 1 << 30;      // accesses of a program that make the region read larger by a factor
  int reads = 1 << 30;        // of images by an element of a Func, when all is inlined
  bool has_integers = false;  // their operators; values are small, so that none overflows
  bool has_rules = false;     // fast functions and rules of derivatives
  bool has_runs = false;      // regions of many sizes, all that updates of outputs touch in them
  bool has_exact_reads = false;  // pieces only; an image is read where it is, as far as it goes
  // Defines f as the sine of source by a C function.
  std::function<void(Func f, const Func& source)> extern_sine = {};

  static Style gradients();  // floats: made to break propagate_adjoints
  static Style updates();    // Funcs that overwrite themselves at random places
  static Style pieces();     // of programs for images, at sizes that no vector divides
  static Style pipelines();  // all types and schedules: made to break the compiler
  static Style chains();     // five to twelve Funcs at changing resolution: for sliding windows
};

// Elements in each dimension of what updates work on.
constexpr int natural_size = 5;

// UserError: the program is no legal one.
RandomProgram make_program(Choices& choices, const Style& style);

std::vector<graph::FuncPtr> outputs_of(const RandomProgram& program);

// As text that opt reads: the graph; then the schedule, and the regions of each run.
std::string to_text(const RandomProgram& program, const ScheduleLog& schedule = {});

}  // namespace retrograde::fuzz
