#include "lower/device/thread_elements.h"

#include <algorithm>
#include <functional>
#include <map>

#include "analysis/linear.h"
#include "ir/visit.h"
#include "lower/expand_lets_in_scope.h"
#include "simplify/facts.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

using Digit = ThreadElements::Digit;

// A loop counter as it appears in an index.
struct Place {
  Expr value;  // counts from 0
  int64_t factor = 1, extent = 1;
  int thread = -1;
  bool is_reversed = false;  // counted down from the last iteration, because its factor is negative
};
struct AccessIndex {
  std::vector<Place> places;
  int64_t constant = 0;
  int64_t lane_stride = 0, lanes = 1;  // of a ramp
};

struct LoopAround {
  std::string name;
  Expr min;  // in terms of names outside of the loop
  int64_t extent = 0;
  int thread = -1;
};

std::optional<int64_t> largest_extent(const Expr& extent) {
  if (const auto constant = as_const_int(extent)) return *constant;
  simplification::Facts facts;
  const int64_t most = std::min(facts.range(extent).max, facts.upper_bound(ir::sum_of(extent)));
  constexpr int64_t unknown = int64_t{1} << 30;
  return most < unknown ? std::optional(most) : std::nullopt;
}

// Walks a kernel's body; `on_access` gets the index of each access and returns the new one.
class AccessWalker : public Rewriter {
 public:
  using OnAccess = std::function<Expr(const AccessWalker&, const Expr& index)>;
  AccessWalker(const Kernel& kernel, const std::string& storage, OnAccess on_access)
      : kernel_(kernel), storage_(storage), on_access_(std::move(on_access)) {}

  // nullopt if the index is not a sum of loop counters.
  std::optional<AccessIndex> split(const Expr& index) const {
    AccessIndex result;
    Expr base = index;
    if (const auto* ramp = index.as<Ramp>()) {
      const auto stride = as_const_int(ramp->stride);
      if (!stride || *stride <= 0) return std::nullopt;
      result.lane_stride = *stride;
      result.lanes = ramp->lanes;
      base = ramp->base;
    }
    if (!base.type().is_scalar()) return std::nullopt;
    base = expand_lets_in_scope(base, lets_);
    // Inner loops first, because their minima may depend on outer loops.
    std::vector<std::string> names;
    simplification::BoundsMap bounds;
    for (auto loop = loops_.rbegin(); loop != loops_.rend(); ++loop) {
      if (!uses_variable(base, loop->name)) continue;
      names.push_back(loop->name + ".place");
      base = substitute(base, loop->name, loop->min + variable(names.back()));
      if (loop->extent > 0) bounds[names.back()] = {Expr(0), make_const(Int(32), loop->extent - 1)};
    }
    const auto sum = analysis::decompose(simplification::simplify(base, bounds), names);
    if (!sum) return std::nullopt;
    const auto constant = as_const_int(simplify(sum->rest));
    if (!constant) return std::nullopt;
    result.constant = *constant;
    for (const auto& [name, factor] : sum->coefficients) {
      const auto loop = std::ranges::find_if(
          loops_, [&, &name = name](const LoopAround& l) { return l.name + ".place" == name; });
      if (loop->extent <= 0) return std::nullopt;
      if (factor == 0) continue;
      Place place{variable(loop->name) - loop->min, factor, loop->extent, loop->thread};
      if (factor < 0) {
        const int64_t last = loop->extent - 1;
        place.value = make_const(place.value.type(), last) - place.value;
        place.factor = -factor;
        place.is_reversed = true;
        result.constant += factor * last;
      }
      result.places.push_back(std::move(place));
    }
    return result.constant < 0 ? std::nullopt : std::optional(result);
  }

 protected:
  Expr rewrite(const Expr& e) override {
    if (const auto* let = e.as<Let>()) lets_[let->name] = let->value;
    const auto* load = e.as<Load>();
    if (!load || load->name != storage_) return children(e);
    return make_load(load->type, load->name, on_access_(*this, load->index),
                     (*this)(load->predicate), load->symbol);
  }

  Stmt rewrite(const Stmt& s) override {
    if (const auto* let = s.as<LetStmt>()) lets_[let->name] = let->value;
    if (const auto* loop = s.as<For>()) return in_loop(s, *loop);
    const auto* store = s.as<Store>();
    if (!store || store->name != storage_) return children(s);
    const Expr value = (*this)(store->value), predicate = (*this)(store->predicate);
    return make_store(store->name, value, on_access_(*this, store->index), predicate,
                      store->symbol);
  }

 private:
  Stmt in_loop(const Stmt& s, const For& loop) {
    LoopAround around{loop.name, expand_lets_in_scope(loop.min, lets_),
                      largest_extent(expand_lets_in_scope(loop.extent, lets_)).value_or(0)};
    if (is_gpu_thread(loop.runs)) around.thread = thread_depth(loop.body);
    loops_.push_back(std::move(around));
    Stmt result = children(s);
    loops_.pop_back();
    return result;
  }

  const Kernel& kernel_;
  const std::string& storage_;
  const OnAccess on_access_;
  std::vector<LoopAround> loops_;  // outermost first
  Substitution lets_;
};

// `told_apart`: the dimensions whose threads must be determined by the element.
class ElementsFinder {
 public:
  ElementsFinder(const Kernel& kernel, const std::string& storage,
                 std::array<bool, 3> told_apart = {true, true, true})
      : kernel_(kernel), storage_(storage), told_apart_(told_apart) {}

  std::optional<ThreadElements> find() {
    AccessWalker(kernel_, storage_, [&](const AccessWalker& walker, const Expr& index) {
      if (auto access = walker.split(index)) {
        accesses_.push_back(std::move(*access));
      } else {
        fails_ = true;
      }
      return index;
    })(kernel_.body);
    if (fails_ || !gather_threads()) return std::nullopt;
    for (const AccessIndex& access : accesses_) {
      if (!gather_others(access)) return std::nullopt;
    }
    return numbered();
  }

  // Splits a constant into digits that lie between those of the threads; keyed by factor.
  static std::optional<std::map<int64_t, int64_t>> places_of(int64_t constant,
                                                             const std::vector<Digit>& threads) {
    std::map<int64_t, int64_t> places;
    for (auto thread = threads.rbegin(); thread != threads.rend(); ++thread) {
      const int64_t above = thread->factor * thread->extent;
      if (constant >= above) places[above] = constant / above;
      constant %= above;
      if (constant >= thread->factor) return std::nullopt;
    }
    if (constant > 0) places[1] = constant;
    return places;
  }

 private:
  bool is_told_apart(int thread) const {
    const auto d = static_cast<size_t>(thread);
    return thread >= 0 && told_apart_[d] && kernel_.threads[d] > 1;
  }

  // Each dimension with more than one thread must have the same factor in all accesses.
  bool gather_threads() {
    for (int d = 0; d < 3; ++d) {
      if (!is_told_apart(d)) continue;
      Digit digit{0, 1, d};
      for (const AccessIndex& access : accesses_) {
        const auto place = std::ranges::find(access.places, d, &Place::thread);
        if (place == access.places.end() || place->is_reversed) return false;
        if (digit.factor != 0 && digit.factor != place->factor) return false;
        digit.factor = place->factor;
        digit.extent = std::max(digit.extent, place->extent);
      }
      if (digit.factor != 0) threads_.push_back(digit);
    }
    std::ranges::sort(threads_, {}, &Digit::factor);
    return true;
  }

  // The largest value of each other digit in this access: the sum of loops with the same factor, lanes and constants.
  bool gather_others(const AccessIndex& access) {
    const auto constant = places_of(access.constant, threads_);
    if (!constant) return false;
    std::map<int64_t, int64_t> largest = *constant;
    if (access.lanes > 1) largest[access.lane_stride] += access.lanes - 1;
    for (const Place& place : access.places) {
      if (!is_told_apart(place.thread)) largest[place.factor] += place.extent - 1;
    }
    for (const auto& [factor, value] : largest)
      others_[factor] = std::max(others_[factor], value + 1);
    return true;
  }

  std::optional<ThreadElements> numbered() const {
    ThreadElements result;
    result.digits = threads_;
    for (const auto& [factor, extent] : others_) result.digits.push_back({factor, extent});
    std::ranges::stable_sort(result.digits, {}, &Digit::factor);
    int64_t largest = 0;  // the largest sum of the smaller digits
    for (Digit& digit : result.digits) {
      if (digit.factor <= largest) return std::nullopt;
      largest += digit.factor * (digit.extent - 1);
      digit.own_factor = result.own_count;
      int64_t own = digit.extent;
      if (digit.thread >= 0) {
        const int64_t threads = kernel_.threads[static_cast<size_t>(digit.thread)];
        own = (digit.extent + threads - 1) / threads;
      }
      result.own_count *= own;
    }
    return result;
  }

  const Kernel& kernel_;
  const std::string& storage_;
  const std::array<bool, 3> told_apart_;
  std::vector<AccessIndex> accesses_;
  bool fails_ = false;
  std::vector<Digit> threads_;
  std::map<int64_t, int64_t> others_;  // extents by factor
};

}  // namespace

std::optional<ThreadElements> find_thread_elements(const Kernel& kernel,
                                                   const std::string& storage) {
  return ElementsFinder(kernel, storage).find();
}

// A warp consists of whole rows of threads if the row length divides the warp size; likewise of whole planes.
bool belongs_to_one_warp(const Kernel& kernel, const std::string& storage) {
  const int row = kernel.threads[0], plane = row * kernel.threads[1];
  const bool has_rows = warp_threads % row == 0, has_planes = warp_threads % plane == 0;
  if (!has_rows) return false;
  return ElementsFinder(kernel, storage, {false, !has_planes, true}).find().has_value();
}

Stmt renumbered_privately(const Kernel& kernel, const std::string& storage,
                          const ThreadElements& elements) {
  std::vector<Digit> threads;
  std::ranges::copy_if(elements.digits, std::back_inserter(threads),
                       [](const Digit& digit) { return digit.thread >= 0; });
  const auto digit_of = [&](int64_t factor, int thread) {
    return *std::ranges::find_if(elements.digits, [&](const Digit& digit) {
      return digit.factor == factor && digit.thread == thread;
    });
  };
  const auto number = [&](const AccessWalker& walker, const Expr& index) {
    const AccessIndex access = *walker.split(index);
    Expr own = 0;
    for (const Place& place : access.places) {
      const int64_t threads_there =
          place.thread < 0 ? 1 : kernel.threads[static_cast<size_t>(place.thread)];
      if (threads_there == 1) {
        own = own + place.value * static_cast<int>(digit_of(place.factor, -1).own_factor);
        continue;
      }
      const Digit& digit = digit_of(place.factor, place.thread);
      if (digit.extent <= threads_there) continue;
      own =
          own + place.value / static_cast<int>(threads_there) * static_cast<int>(digit.own_factor);
    }
    const auto constant = ElementsFinder::places_of(access.constant, threads);
    for (const auto& [factor, value] : *constant)
      own = own + static_cast<int>(value * digit_of(factor, -1).own_factor);
    own = simplify(cast_to(index.type().element_of(), own));
    if (access.lanes == 1) return own;
    const auto stride = digit_of(access.lane_stride, -1).own_factor;
    return make_ramp(own, make_const(own.type(), stride), static_cast<int>(access.lanes));
  };
  return AccessWalker(kernel, storage, number)(kernel.body);
}

}  // namespace retrograde::lower
