// sizes.h -- how long loops and dimensions are: the only place that guesses.
//
// Sources, the best first: a bound of the user, an estimate of the user (set_estimate), the shape of an image, the
// region that consumers read, a default for what nothing is known of. An output that is the adjoint of a Func is as large
// as that Func.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "analysis/interval.h"
#include "autoschedule/access/access_graph.h"

namespace retrograde::planning {

enum class SizeSource : uint8_t { Bound, Estimate, Image, Region, Default };

struct Extent {
  int64_t estimate = 0;
  int64_t low = 0, high = 0;  // between which it lies for certain
  int64_t multiple_of = 1;
  SizeSource source = SizeSource::Default;

  bool is_known() const { return source != SizeSource::Default; }
  bool is_constant() const { return low == high; }
};

struct SizeDefaults {
  int64_t extent;  // of a dimension of which nothing is known
};

class SizeModel {
 public:
  SizeModel(const AccessGraph& graph, const SizeDefaults& defaults);

  const AccessGraph& graph() const { return graph_; }
  Extent of(FuncId func, size_t dimension) const;
  Extent of_image(ImageId image, size_t dimension) const;
  Extent of(StageId stage, int iterator) const;
  // A dimension of the Func or image that is accessed.
  Extent of(const Access& access, size_t dimension) const {
    return access.of >= 0 ? of(access.of, dimension) : of_image(access.image, dimension);
  }
  // The coordinates that are computed.
  ir::ConstantRange range(FuncId func, size_t dimension) const;
  ir::ConstantRange range(StageId stage, int iterator) const;
  // The values of an index while all iterators run; an end of int64's range: unbounded.
  ir::ConstantRange range(const IndexForm& form, StageId stage) const;
  // An interval whose ends mention parameters only.
  ir::ConstantRange range(const Interval& interval) const;

 private:
  struct Known {
    ir::ConstantRange range;
    SizeSource source = SizeSource::Default;
    bool is_certain = false;  // no estimate takes part
    int64_t multiple_of = 1;
    // The part of a region that reads need which nothing clamps, guards or takes from data.
    ir::ConstantRange needed{INT64_MAX, INT64_MIN};
  };
  struct End {
    std::optional<int64_t> value;
    SizeSource source = SizeSource::Default;
    bool is_certain = false;
  };
  struct Ends {
    End min, max;
  };

  void find_all();
  bool add_adjoints();
  void add_parameters();
  void find_image(ImageId image);
  void find_func(FuncId id);
  void find_iterators(StageId stage);
  bool is_needed(const Access& read, size_t dimension) const;
  void pass_on(const Access& read);
  static void extend(Ends& ends, const ir::ConstantRange& needed);
  Ends told(const FuncNode& node, size_t dimension) const;
  void refine(Ends& ends, const Expr& min, const Expr& extent, SizeSource source) const;
  Known settled(const Ends& ends, const Known* region) const;
  std::optional<int64_t> certain_value(const Expr& e) const;
  std::optional<int64_t> end_of(const Expr& e, bool is_min) const;
  ir::ConstantRange bounds_in(const Expr& index, StageId stage) const;
  Extent extent_of(const Known& known) const;

  const AccessGraph& graph_;
  const SizeDefaults defaults_;
  analysis::Scope<Interval> parameters_;  // with estimates
  // The smallest and the largest value of expressions over parameters, which are asked for again and again.
  using KnownEnd = std::pair<Expr, std::optional<int64_t>>;
  mutable std::array<std::unordered_map<const ir::ExprNode*, KnownEnd>, 2> ends_;
  // The bounds of indices while all iterators of a stage run.
  mutable std::map<std::pair<StageId, const ir::ExprNode*>, std::pair<Expr, ir::ConstantRange>>
      bounds_;
  std::vector<std::vector<Known>> funcs_, images_;
  std::map<FuncId, std::vector<Known>> adjoints_;  // outputs of which nothing else is known
  std::vector<std::vector<std::optional<Known>>> regions_;  // of Funcs, by their consumers
  std::vector<std::vector<std::vector<Known>>> iterators_;  // by Func, stage, iterator
};

}  // namespace retrograde::planning
