// check_func_directive.cpp -- legality rules for directives of Funcs: storage levels, storage
// layout, bounds and estimates.
#include <algorithm>

#include "diagnostics/error.h"
#include "graph/definitions/define.h"
#include "graph/definitions/definition_rules.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "ir/literal.h"
#include "ir/print.h"

namespace retrograde::graph {

namespace {

std::string dimensions_of(const FuncContents& f) {
  const std::string args = listed(f.args, quoted);
  return args.empty() ? "it has no dimensions" : "its variables are " + args;
}

void check_is_dimension(const FuncContents& f, const std::string& var, const std::string& asked) {
  check_is_defined(f, asked);
  if (std::ranges::find(f.args, var) != f.args.end()) return;
  user_error(asked, quoted(var) + " must be a pure variable of the first definition",
             dimensions_of(f), "Name one of them");
}

bool is_integer(const Expr& e) { return e.type().is_int_or_uint() && e.type().is_scalar(); }

// Converts an integer size to int32; checks that a constant is positive.
void check_size(Expr& e, const char* what, const std::string& asked) {
  if (!e.defined())
    user_error(asked, text("the ", what, " must be a defined expression"), "it was never assigned",
               "Assign every Expr before it is used");
  if (!is_integer(e)) {
    user_error(asked, text("the ", what, " is an integer"),
               text(e, " has type ", to_string(e.type())), "Give an integer");
  }
  check_over_parameters(e, text("the ", what).c_str(), asked);
  const auto constant = as_const_int(e);
  if (constant && (*constant <= 0 || *constant > INT32_MAX)) {
    user_error(asked, text("the ", what, " is at least 1 and fits an int32"),
               text("it is ", *constant), "Give a positive number");
  }
  e = cast_to(Int(32), e);
}

// Rejects constant bounds and alignments of one variable that contradict each other.
void check_alignment(const Bound& bound, const std::string& asked) {
  if (!bound.modulus.defined()) return;
  const auto constant = [](const Expr& e) { return e.defined() ? as_const_int(e) : std::nullopt; };
  const auto modulus = constant(bound.modulus), min = constant(bound.min);
  const auto extent = constant(bound.extent), remainder = constant(bound.remainder);
  if (modulus && extent && *extent % *modulus != 0) {
    user_error(asked, "the extent is a multiple of the modulus",
               text("the extent is ", *extent, " and the modulus ", *modulus),
               "Bound it to a multiple");
  }
  if (modulus && min && remainder && ((*min - *remainder) % *modulus) != 0) {
    user_error(asked, text("min % ", *modulus, " is the remainder ", *remainder),
               text("the min is ", *min), "Give the remainder that the min has");
  }
}

Bound bound_of(const std::vector<Bound>& bounds, const std::string& var) {
  for (const Bound& bound : bounds) {
    if (bound.var == var) return bound;
  }
  return {};
}

// Checks the range of a bound or an estimate.
void check_range(const FuncContents& f, const std::vector<Bound>& bounds, const std::string& var,
                 Expr& min, Expr& extent, const std::string& asked) {
  check_is_dimension(f, var, asked);
  if (!extent.defined())
    user_error(asked, "the extent must be a defined expression", "it was never assigned",
               "Give the extent");
  for (Expr* e : {&min, &extent}) {
    if (!e->defined()) continue;
    if (!is_integer(*e)) {
      user_error(asked, "bounds are integers", text(*e, " has type ", to_string(e->type())),
                 "Convert it: cast<int>(...)");
    }
    check_over_parameters(*e, "a bound", asked);
    *e = int32_literal(*e, asked);
  }
  const auto constant = as_const_int(extent);
  if (constant && *constant < 0)
    user_error(asked, "an extent is not negative", text("it is ", *constant), "Give 0 or more");
  Bound changed = bound_of(bounds, var);
  changed.min = min;
  changed.extent = extent;
  check_alignment(changed, asked);
}

// Checks a directive that the message calls "`verb` the storage of f in dimension", and its size.
void check_storage(const FuncContents& f, const char* verb, const std::string& dimension,
                   Expr& size, const char* what) {
  const std::string asked =
      text(verb, " the storage of ", quoted(f.name), " in ", quoted(dimension));
  check_size(size, what, asked);
  check_is_dimension(f, dimension, asked);
}

// ---- one function per directive with rules ----

template <typename D>
void check(D&, const FuncContents&) {}

// Dimensions that are not named keep their positions.
void check(ReorderStorage& reorder, const FuncContents& f) {
  const std::string asked = "reorder the storage of " + quoted(f.name);
  check_is_defined(f, asked);
  std::vector<std::string> storage = f.schedule.storage_dims;
  std::vector<size_t> places;
  for (const std::string& dim : reorder.dimensions) {
    const auto it = std::ranges::find(storage, dim);
    if (it == storage.end())
      user_error(asked, quoted(dim) + " must be one of its dimensions", dimensions_of(f),
                 "Name one of them");
    const size_t place = static_cast<size_t>(it - storage.begin());
    if (std::ranges::find(places, place) != places.end()) {
      user_error(asked, "each dimension is named once", quoted(dim) + " is named twice",
                 "Drop one of them");
    }
    places.push_back(place);
  }
  std::ranges::sort(places);
  for (size_t i = 0; i < places.size(); i++) storage[places[i]] = reorder.dimensions[i];
  reorder.dimensions = std::move(storage);
}

void check(AlignStorage& align, const FuncContents& f) {
  check_storage(f, "align", align.dimension, align.alignment, "alignment");
}
void check(FoldStorage& fold, const FuncContents& f) {
  check_storage(f, "fold", fold.dimension, fold.extent, "extent");
}
void check(RingBuffer& ring, const FuncContents& f) {
  check_size(ring.copies, "number of copies", "keep a ring buffer of " + quoted(f.name));
}
void check(BoundStorage& bound, const FuncContents& f) {
  check_storage(f, "bound", bound.dimension, bound.extent, "bound");
}

void check(Memoize& memoize, const FuncContents& f) {
  const Expr& key = memoize.key;
  if (!key.defined()) return;
  const std::string asked = "memoize " + quoted(f.name);
  if (!key.type().is_int_or_uint() && !key.type().is_handle()) {
    user_error(asked, "an eviction key is an integer or a pointer",
               text(key, " has type ", to_string(key.type())), "Convert it to uint64");
  }
  check_over_parameters(key, "the eviction key", asked);
  if (const Expr& earlier = f.schedule.eviction_key; earlier.defined()) {
    user_error(asked, "a Func has one eviction key",
               text("it was given ", earlier, " before, and now ", key),
               "Give the key once; combine two with arithmetic");
  }
}

void check(BoundDimension& bound, const FuncContents& f) {
  check_range(f, f.schedule.bounds, bound.dimension, bound.min, bound.extent,
              text("bound ", quoted(bound.dimension), " of ", quoted(f.name)));
}
void check(Estimate& estimate, const FuncContents& f) {
  check_range(f, f.schedule.estimates, estimate.dimension, estimate.min, estimate.extent,
              text("estimate ", quoted(estimate.dimension), " of ", quoted(f.name)));
}
void check(AlignBounds& align, const FuncContents& f) {
  const std::string asked =
      text("align the bounds of ", quoted(align.dimension), " of ", quoted(f.name));
  check_is_dimension(f, align.dimension, asked);
  check_size(align.modulus, "modulus", asked);
  if (align.remainder.defined()) {
    if (!is_integer(align.remainder)) {
      user_error(asked, "the remainder is an integer",
                 text(align.remainder, " has type ", to_string(align.remainder.type())),
                 "Give an integer");
    }
    check_over_parameters(align.remainder, "the remainder", asked);
    align.remainder = int32_literal(align.remainder, asked);
  }
  Bound changed = bound_of(f.schedule.bounds, align.dimension);
  changed.modulus = align.modulus;
  changed.remainder = align.remainder;
  check_alignment(changed, asked);
}

void check(DebugToFile& debug, const FuncContents& f) {
  const StringImm* file = debug.file.as<StringImm>();
  if (file && !file->value.empty()) return;
  user_error("write " + quoted(f.name) + " to a file", "the file has a name", "it is empty",
             "Give a name that ends in .npy or .tmp");
}

}  // namespace

void check_is_defined(const FuncContents& f, const std::string& asked) {
  if (f.is_defined()) return;
  user_error(asked, quoted(f.name) + " needs a definition first", "it has none",
             "Define it: f(x, y) = ...");
}

void check_func_directive(const SchedulePlace& place, Directive& directive) {
  std::visit([&](auto& d) { check(d, *place.f); }, directive);
}

}  // namespace retrograde::graph
