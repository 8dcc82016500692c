// ring_buffers -- give hoisted storage several copies that iterations use in turn.
// In:  Loops; names unique; async Funcs forked.
// Out: Loops; storage of Funcs with ring_buffer(n) lies in one of n copies.
//
//   realize f.place [0, m] {              realize f.place [0, m], [0, n] {
//     for y {                               for y {
//       realize f [a, e] { ... }     =>       realize f [a, e], [(y - y.min) % n * m, 1] { ... }
//     } }                                   } }
//
// Method: counts the iterations of the loops between the hoisted storage and the Func, innermost fastest, modulo the
//         number of copies. Producer and consumer of an async Func count separately.
// Errors: loops that are not serial; Funcs whose storage is not hoisted; inner loops of an async Func with varying
//         extents, for which two consecutive iterations could use the same copy.
// Source: folklore. Tests: test/golden/pipeline/ring_buffers/, test/unit/lower/ring_buffer_test.cpp.
#include "lower/loops/ring_buffers.h"

#include <map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "diagnostics/error.h"
#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/print.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

[[noreturn]] void refuse(const std::string& func, const std::string& evidence,
                         const std::string& instead) {
  user_error("keep a ring buffer of " + quoted(func),
             "a ring buffer lies in storage that is hoisted over serial loops", evidence, instead);
}

class RingBuffers : public StatementRewriter {
 public:
  explicit RingBuffers(const Program& program) : program_(program) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (const For* loop = s.as<For>()) {
      loops_.push_back(loop);
      Stmt result = binding(loop->name, s);
      loops_.pop_back();
      return result;
    }
    if (const LetStmt* let = s.as<LetStmt>()) return binding(let->name, s);
    const Realize* n = s.as<Realize>();
    if (!n) return children(s);
    if (const LoopedFunc* f = func_at_place(n->name)) return copies(*n, *f);
    const LoopedFunc* f = program_.find(n->name);
    const auto place = f ? places_.find(f->name()) : places_.end();
    return place == places_.end() ? children(s) : in_copy(*n, *f, place->second);
  }

 private:
  struct Place {
    const Realize* realize = nullptr;
    size_t loops_around = 0, names_around = 0;
  };
  const Program& program_;
  std::vector<const For*> loops_;        // around the current statement, outermost first
  std::vector<std::string> names_;       // of loops and lets around it
  std::map<std::string, Place> places_;  // hoisted storage around it, by Func

  Stmt binding(const std::string& name, const Stmt& s) {
    names_.push_back(name);
    Stmt result = children(s);
    names_.pop_back();
    return result;
  }

  // The Func with a ring buffer whose hoisted storage is realized under this name.
  const LoopedFunc* func_at_place(const std::string& name) const {
    const std::string place = original_name(name);
    const LoopedFunc* f = program_.find(place.substr(0, place.rfind('.')));
    return f && f->schedule.ring.defined() && place == place_name(f->name()) ? f : nullptr;
  }

  Stmt copies(const Realize& n, const LoopedFunc& f) {
    std::vector<Range> bounds = n.bounds;
    bounds.push_back({0, f.schedule.ring});
    Place& place = places_[f.name()];
    const Place around = std::exchange(place, {&n, loops_.size(), names_.size()});
    const Stmt body = (*this)(n.body);
    if (around.realize)
      place = around;
    else
      places_.erase(f.name());
    return with_bounds(n, bounds, body);
  }

  Stmt in_copy(const Realize& n, const LoopedFunc& f, const Place& place) {
    const std::unordered_set<std::string> inside(
        names_.begin() + static_cast<std::ptrdiff_t>(place.names_around), names_.end());
    Expr copy = Expr(0), elements = Expr(1);
    for (size_t i = place.loops_around; i < loops_.size(); i++) {
      const For& loop = *loops_[i];
      check_is_serial(loop, f);
      const Expr here = binary(Kind::Sub, variable(loop.name), loop.min);
      if (i > place.loops_around) {
        if (f.schedule.async && uses_any_variable(loop.extent, inside))
          refuse_ring(f, text("the extent of the loop ", describe_loop(loop.name), " varies"));
        copy = binary(Kind::Mul, copy, loop.extent);
      }
      copy = binary(Kind::Mod, binary(Kind::Add, copy, here), f.schedule.ring);
    }
    for (size_t d = 0; d < n.bounds.size(); d++) {
      elements = binary(Kind::Mul, elements, metadata(place.realize->name, Metadata::Extent, d));
    }
    StorageLayout layout = n.layout;
    layout.first = binary(Kind::Mul, copy, elements);
    return make_realize(n.name, n.types, n.memory, n.bounds, (*this)(n.body), layout);
  }

  static void check_is_serial(const For& loop, const LoopedFunc& f) {
    if (loop.runs == ForType::Serial || loop.runs == ForType::Unrolled) return;
    refuse(f.name(), text("the loop ", describe_loop(loop.name), " runs its iterations at once"),
           text("Hoist the storage of ", quoted(f.name()), " to a loop inside of that one"));
  }
};

}  // namespace

int copies_in_ring(const LoopedFunc& f) {
  const auto copies = as_const_int(f.schedule.ring);
  if (copies) return static_cast<int>(*copies);
  user_error("compute " + quoted(f.name()) + " async in a ring buffer",
             "an async Func has a constant number of copies",
             text("their number is ", f.schedule.ring), "Give a number, or leave async() out");
}

void refuse_ring(const LoopedFunc& f, const std::string& evidence) {
  unsupported("compute " + quoted(f.name()) + " async in a ring buffer",
              "an async Func in a ring buffer is computed where it is stored, at one place, in "
              "loops of fixed extent",
              evidence,
              text("Hoist the storage of ", quoted(f.name()),
                   " to a loop further in, or leave async() or ring_buffer() out"));
}

Stmt ring_buffers(const Stmt& s, const Program& program) {
  bool any = false;
  for (const LoopedFunc& f : program.funcs) {
    if (!f.schedule.ring.defined()) continue;
    any = true;
    if (f.is_output || !is_hoisted(f))
      refuse(f.name(),
             f.is_output ? "it is an output, whose storage is the caller's"
                         : "its storage is allocated where it is stored",
             text("Call hoist_storage() with a loop around the one that ", quoted(f.name()),
                  " is stored in, or leave ring_buffer() out"));
    if (f.schedule.memoized)
      refuse(f.name(), "it is memoized, and its storage the cache's", "Leave memoize() out");
  }
  return any ? RingBuffers(program)(s) : s;
}

}  // namespace retrograde::lower
