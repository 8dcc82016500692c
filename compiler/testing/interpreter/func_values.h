// func_values.h -- the values of Funcs on demand. A pure Func is evaluated, and memoised, point by point. A Func with
// updates has its updates run over the smallest box around the requested points and those that the updates access.
#pragma once

#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "testing/interpreter/expressions.h"

namespace retrograde::oracle {

class FuncValues : public FuncReader {
 public:
  FuncValues(const InterpreterOptions& options, Inputs& inputs)
      : options_(options), expressions_(options, inputs, *this) {}

  Value read(const graph::FuncContents& func, const Point& point, int component) override;
  // The Func's values over a region: one Array for each value of the Tuple.
  std::vector<Array> realize(const graph::FuncContents& func, const Region& region);
  void clear() { states_.clear(); }

 private:
  // Storage of one slice of a Func with updates, over a box of its scattered dimensions. Cells are initialised from the
  // pure definition when first read.
  struct Island {
    Region box;
    std::vector<Value> cells;  // point-major, one for each value of the Tuple
    std::vector<bool> written;
    Hull reached;  // accessed points, also outside of the box
    bool grows_on_store = true;
    bool poisoned = false;  // a store had an unstable index
  };

  struct FuncState {
    const graph::FuncContents* func = nullptr;
    std::vector<Frame> stages;
    std::vector<int> pure_dims, scattered_dims;
    std::unordered_map<Point, std::vector<Value>, PointHash> memo;  // pure Funcs
    std::unordered_map<Point, std::vector<std::unique_ptr<Island>>, PointHash> slices;
    Island* active = nullptr;  // the island being computed
    Point active_slice;
  };

  // The store of an update at one point.
  struct Store {
    Point point;
    std::vector<Value> values;
    bool unsure = false;  // the store itself depends on an unstable condition
  };

  FuncState& state_of(const graph::FuncContents& func);
  static std::unique_ptr<FuncState> make_state(const graph::FuncContents& func);

  Value read(FuncState& f, const Point& point, int component);
  const std::vector<Value>& pure_values(FuncState& f, const Point& point);
  std::vector<Value> evaluate_pure(FuncState& f, const Point& point);
  void check_size(const FuncState& f, size_t points) const;

  Value* cell(FuncState& f, Island& island, const Point& point, const Point& place);
  Value read_self(FuncState& f, const Point& point, const Point& slice, const Point& place,
                  int component);
  Island& island_at(FuncState& f, const Point& slice, const Point& place);
  void compute(FuncState& f, const Point& slice, const Point& place, Island& island);

  void run_update(FuncState& f, Frame& frame, Island& island);
  void add_reduction_loops(FuncState& f, Frame& frame, Region& loops, std::vector<int>& positions);
  void update_points(FuncState& f, Frame& frame, Island& island);
  std::optional<Store> update_at(Frame& frame, Island& island);
  void store(FuncState& f, Island& island, const Store& update);

  const InterpreterOptions& options_;
  Expressions expressions_;
  std::unordered_map<const graph::FuncContents*, std::unique_ptr<FuncState>> states_;
};

}  // namespace retrograde::oracle
