// work_tree.cpp -- one walk of a lowered function, outside in.
#include "tuning/work_tree.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <unordered_map>

#include "ir/build.h"
#include "ir/visit.h"
#include "tuning/operation_work.h"

namespace retrograde::tuning {

void Work::add(const Work& other, double times) {
  for (double Work::*part :
       {&Work::operations, &Work::divisions, &Work::double_divisions, &Work::roots,
        &Work::double_roots, &Work::exps, &Work::logs, &Work::pows, &Work::sines, &Work::loads,
        &Work::stores, &Work::gather_lanes, &Work::scatter_lanes, &Work::shuffles, &Work::scalars,
        &Work::scalar_divisions})
    this->*part += times * other.*part;
  chain = std::max(chain, other.chain);
  memory_chain = std::max(memory_chain, other.memory_chain);
}

double WorkTree::times(int node) const {
  double result = 1;
  for (int n = node; n >= 0; n = nodes[static_cast<size_t>(n)].parent)
    result *= nodes[static_cast<size_t>(n)].trips;
  return result;
}

Work WorkTree::total() const {
  Work result;
  for (size_t n = 0; n < nodes.size(); n++) {
    for (const auto& [stage, work] : nodes[n].work) result.add(work, times(static_cast<int>(n)));
  }
  return result;
}

namespace {

using Names = std::unordered_set<std::string>;

// By loop, what is stored in its body; and the allocations whose places are all constants.
struct Surroundings {
  std::unordered_map<const For*, Names> stored;
  Names indexed;  // at places that are not constant
};

void look_at(const Stmt& s, Surroundings& found, Names& stored) {
  if (const For* loop = s.as<For>()) {
    Names inside;
    look_at(loop->body, found, inside);
    stored.insert(inside.begin(), inside.end());
    found.stored[loop] = std::move(inside);
    return;
  }
  if (const Store* store = s.as<Store>()) stored.insert(store->name);
  for_each_child(
      s, [](const Expr&) {}, [&](const Stmt& part) { look_at(part, found, stored); });
}

bool is_constant_place(const Expr& index) {
  if (const Ramp* ramp = index.as<Ramp>())
    return is_constant_place(ramp->base) && is_constant_place(ramp->stride);
  if (const Broadcast* all = index.as<Broadcast>()) return is_constant_place(all->value);
  return as_scalar(index).has_value();
}

Surroundings surroundings(const Stmt& body) {
  Surroundings result;
  Names all;
  look_at(body, result, all);
  walk(
      body,
      [&](const Load& n) {
        if (!is_constant_place(n.index)) result.indexed.insert(n.name);
      },
      [&](const Store& n) {
        if (!is_constant_place(n.index)) result.indexed.insert(n.name);
      });
  return result;
}

class TreeBuilder {
 public:
  TreeBuilder(const LoweredFunction& function, const ProgramSizes& sizes,
              const TreeOptions& options)
      : options_(options), values_(sizes), around_(surroundings(function.body)) {
    tree_.stages.push_back("");
    tree_.nodes.emplace_back();
    values_.enter("", KnownValue(), 1, {});
    charged_.emplace_back();
    for (const auto& [name, shape] : sizes.buffers)
      tree_.buffers[static_cast<size_t>(buffer_of(name))].bytes = shape.bytes();
  }

  WorkTree build(const Stmt& body) {
    visit(body);
    return std::move(tree_);
  }

 private:
  const TreeOptions options_;
  KnownValues values_;
  const Surroundings around_;
  WorkTree tree_;
  std::vector<int> chain_ = {0};                       // nodes around, by place
  std::vector<std::unordered_set<uint64_t>> charged_;  // numbers, by place
  std::unordered_map<std::string, int> buffers_, stages_;
  std::map<std::string, double> registers_;  // allocations that are registers: the part that fits
  std::map<std::pair<int, uint64_t>, int> updates_;  // of one element, in one node
  std::unordered_map<int, int> held_;                // loads of outer loops, by node
  int stage_ = 0;

  WorkNode& node(int index) { return tree_.nodes[static_cast<size_t>(index)]; }
  WorkNode& here() { return node(chain_.back()); }

  int buffer_of(const std::string& name) {
    const auto [it, is_new] = buffers_.emplace(name, static_cast<int>(tree_.buffers.size()));
    if (is_new) tree_.buffers.push_back({name});
    return it->second;
  }
  int stage_of(const std::string& name) {
    const auto [it, is_new] = stages_.emplace(name, static_cast<int>(tree_.stages.size()));
    if (is_new) tree_.stages.push_back(name);
    return it->second;
  }

  // ---- statements ----

  void visit(const Stmt& s) {
    if (!s.defined()) return;
    match(
        s, [&](const For& n) { visit_loop(n); }, [&](const Store& n) { visit_store(n); },
        [&](const IfThenElse& n) { visit_branch(n); },
        [&](const LetStmt& n) {
          values_.bind(n.name, values_.of(n.value));
          charge(n.value);
          visit(n.body);
        },
        [&](const ProducerConsumer& n) { visit_produce(n); },
        [&](const Allocate& n) { visit_allocate(n); }, [&](const Assert&) {},
        [&](const Evaluate& n) { charge(n.value); },
        [&](const StmtNode&) {
          for_each_child(
              s, [&](const Expr& e) { charge(e); }, [&](const Stmt& part) { visit(part); });
        });
  }

  void visit_produce(const ProducerConsumer& n) {
    const int outer = stage_;
    if (n.produces) stage_ = stage_of(n.name);
    visit(n.body);
    stage_ = outer;
  }

  void open(WorkNode::Kind kind, const std::string& name, double trips) {
    WorkNode child;
    child.kind = kind;
    child.name = name;
    child.parent = chain_.back();
    child.place = chain_.size();
    child.trips = trips;
    child.stage = stage_;
    child.speedup = here().speedup;
    if (kind == WorkNode::Kind::Parallel) {
      // Tasks of one length: the last round may leave threads without one.
      const double threads = std::max(1.0, std::floor(options_.threads / child.speedup));
      child.speedup *= trips <= 0 ? 1 : trips / std::ceil(trips / threads);
    }
    const int index = static_cast<int>(tree_.nodes.size());
    here().children.push_back(index);
    tree_.nodes.push_back(std::move(child));
    chain_.push_back(index);
    charged_.emplace_back();
  }
  void close() {
    values_.leave();
    chain_.pop_back();
    charged_.pop_back();
  }

  void visit_loop(const For& n) {
    const KnownValue min = values_.of(n.min), extent = values_.of(n.extent);
    if (extent.at < 1) return;
    const bool parallel = runs_at_once(n.runs);
    open(parallel ? WorkNode::Kind::Parallel : WorkNode::Kind::Loop, n.name, extent.at);
    values_.enter(n.name, min, extent.at, around_.stored.at(&n));
    visit(n.body);
    close();
  }

  void visit_branch(const IfThenElse& n) {
    const double taken = values_.of(n.condition).at;
    charge(n.condition);
    visit_arm(n.when_true, taken);
    visit_arm(n.when_false, 1 - taken);
  }
  void visit_arm(const Stmt& arm, double taken) {
    if (!arm.defined() || taken <= 0) return;
    if (taken >= 1) return visit(arm);
    open(WorkNode::Kind::Branch, "", taken);
    values_.enter("", KnownValue(), 1, {});
    visit(arm);
    close();
  }

  void visit_allocate(const Allocate& n) {
    const KnownValue elements = values_.of(n.elements);
    WorkTree::Memory& memory = tree_.buffers[static_cast<size_t>(buffer_of(n.name))];
    memory.bytes = elements.at * n.type.bytes();
    memory.is_allocated = true;
    memory.times = tree_.times(chain_.back());
    const double room = static_cast<double>(options_.vector_bytes) * options_.registers;
    if (elements.is_constant() && memory.bytes <= 4 * room && !around_.indexed.contains(n.name)) {
      // What sums leave of the registers holds operands.
      registers_[n.name] = std::min(1.0, 0.8 * room / std::max(1.0, memory.bytes));
      memory.bytes = 0;
    }
    visit(n.body);
  }

  void visit_store(const Store& n) {
    charge(n.value);
    if (n.predicate.defined()) charge_mask(n.predicate);
    const KnownValue index = values_.of(n.index);
    if (!is_plain(index)) charge(n.index);
    const bool masked = is_masked(n.predicate);
    note_update(n, index);
    move(n.name, n.value.type(), index, true, masked, place_here());
  }

  // ---- expressions ----

  size_t place_here() const { return chain_.size() - 1; }

  // The outermost place where the value is the same in all iterations: no loop between it and here
  // changes it. Branches are not left.
  size_t place_of(const KnownValue& value) {
    size_t place = static_cast<size_t>(std::max(0, value.deepest()));
    if (value.depends == 0) place = 0;
    while (place + 1 < chain_.size() && node(chain_[place + 1]).kind == WorkNode::Kind::Branch)
      place++;
    return std::min(place, place_here());
  }

  // An index that the addressing of loads and stores gives without an operation.
  static bool is_plain(const KnownValue& index) {
    return !index.from_data && !index.lanes.any && !index.lanes.bent;
  }
  static bool is_masked(const Expr& predicate) {
    return predicate.defined() && !as_scalar(predicate).has_value();
  }
  void charge_mask(const Expr& predicate) {
    if (is_masked(predicate)) charge(predicate);
  }

  Work& work_at(size_t place) { return node(chain_[place]).work[stage_]; }

  void charge(const Expr& e) {
    if (e.kind() == Kind::Variable || as_scalar(e)) return;
    const KnownValue value = values_.of(e);
    if (const Load* load = e.as<Load>()) return charge_load(*load, value);
    const size_t place = place_of(value);
    if (!charged_[place].insert(value.number).second) return;
    if (const Let* let = e.as<Let>()) {
      charge(let->value);
      values_.bind(let->name, values_.of(let->value));
      charge(let->body);
      return;
    }
    work_at(place).add(operation_work(e, options_.vector_bytes));
    for_each_child(e, [&](const Expr& child) {
      if (!is_contracted(e, child)) return charge(child);
      for_each_child(child, [&](const Expr& factor) { charge(factor); });
    });
  }

  // What loops use again is held in registers while there are some; the others are loaded each time.
  size_t place_of_load(const KnownValue& value) {
    const size_t place = place_of(value);
    if (place == place_here()) return place;
    int& held = held_[chain_.back()];
    if (held >= options_.registers / 2) return place_here();
    held += !charged_[place].contains(value.number);
    return place;
  }

  void charge_load(const Load& load, const KnownValue& value) {
    const size_t place = place_of_load(value);
    if (!charged_[place].insert(value.number).second) return;
    const KnownValue index = values_.of(load.index);
    if (!is_plain(index)) charge(load.index);
    charge_mask(load.predicate);
    move(load.name, load.type, index, false, is_masked(load.predicate), place);
  }

  void move(const std::string& name, Type type, const KnownValue& index, bool is_store, bool masked,
            size_t place) {
    const Work work = access_work(type, index.lanes, is_store, masked, options_.vector_bytes);
    if (const auto it = registers_.find(name); it != registers_.end()) {
      work_at(place).add(work, 1 - it->second);
      return;
    }
    work_at(place).add(work);
    note_access(name, type, index, is_store, place);
  }

  void note_access(const std::string& name, Type type, const KnownValue& index, bool is_store,
                   size_t place) {
    MemoryAccess access;
    const double bytes = type.bytes();
    access.buffer = buffer_of(name);
    access.stage = stage_;
    access.is_store = is_store;
    for (const int n : chain_)
      access.in_parallel = access.in_parallel || node(n).kind == WorkNode::Kind::Parallel;
    access.at = index.at * bytes;
    const Lanes& lanes = index.lanes;
    const double step = std::abs(lanes.step) * bytes, inner = std::max(1, lanes.inner);
    const double runs = lanes.count / inner;
    if (lanes.any) {
      access.lane_bytes = 2 * bytes * lanes.count;
    } else if (step <= 64) {
      access.lane_bytes = step * (inner - 1) + bytes;
      access.lane_blocks = lanes.outer_step == 0 ? 1 : runs;
    } else {
      access.lane_bytes = bytes;
      access.lane_blocks = inner * (lanes.outer_step == 0 ? 1 : runs);
    }
    if (index.from_data) {
      access.data_range = std::min(index.high - index.low + 1, unbounded) * bytes;
      access.data_loops = index.depends;
    }
    for (const double slope : index.slopes) access.slopes.push_back(slope * bytes);
    node(chain_[place]).accesses.push_back(std::move(access));
  }

  // A store of what was loaded from the same place, and something more: the next one waits for it.
  void note_update(const Store& n, const KnownValue& index) {
    bool reads_itself = false;
    walk(n.value, [&](const Load& load) {
      if (load.name == n.name && values_.of(load.index).number == index.number) reads_itself = true;
    });
    if (!reads_itself) return;
    const WorkNode& loop = here();
    if (loop.is_loop() && index.deepest() == static_cast<int>(loop.place)) return;
    const int count = ++updates_[{chain_.back(), values_.of(n.index).number + buffer_of(n.name)}];
    Work& work = work_at(place_here());
    double& chain = registers_.contains(n.name) ? work.chain : work.memory_chain;
    chain = std::max<double>(chain, count);
  }
};

}  // namespace

WorkTree work_tree(const LoweredFunction& function, const ProgramSizes& sizes,
                   const TreeOptions& options) {
  return TreeBuilder(function, sizes, options).build(function.body);
}

}  // namespace retrograde::tuning
