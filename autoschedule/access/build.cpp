// Builds an access graph from the definitions of a program.
#include <algorithm>

#include "autoschedule/access/access_graph.h"
#include "autoschedule/access/stage_reader.h"
#include "graph/directives/wrappers.h"
#include "ir/equal.h"

namespace retrograde::planning {

IteratorSet Access::moved_by() const {
  IteratorSet result = 0;
  for (const IndexForm& form : index) result |= form.moved_by();
  return result;
}

size_t Access::place_hash() const {
  size_t result = static_cast<size_t>(of * 31 + image);
  const auto mix = [&](uint64_t word) { result = (result ^ word) * 0x9e3779b97f4a7c15u; };
  for (const IndexForm& form : index) {
    for (const Term& term : form.terms) {
      mix(static_cast<uint64_t>(term.iterator));
      mix(static_cast<uint64_t>(term.coefficient));
    }
    for (const OpaqueTerm& term : form.opaque) mix(term.value.number);
    mix(static_cast<uint64_t>(form.low));
  }
  return result ^ result >> 29;
}

AccessGraph::AccessGraph(const std::vector<FuncPtr>& outputs, AccessGraph before)
    : numbers_(std::move(before.numbers_)) {
  const std::vector<FuncPtr> wrapped = apply_wrappers(outputs);
  for (const auto& parameter : parameters_of(wrapped)) {
    if (!parameter->is_buffer) continue;
    image_ids_.emplace(parameter.get(), static_cast<ImageId>(images_.size()));
    images_.push_back(parameter);
  }
  for (const FuncPtr& f : topological_order(wrapped)) {
    ids_.emplace(f.get(), static_cast<FuncId>(funcs_.size()));
    ids_by_name_.emplace(f->name, static_cast<FuncId>(funcs_.size()));
    funcs_.push_back({f, std::ranges::find(wrapped, f) != wrapped.end(), {}});
  }
  consumers_.resize(funcs_.size());
  for (size_t id = 0; id < funcs_.size(); ++id) {
    FuncNode& node = funcs_[id];
    for (int s = 0; s < node.func->stage_count(); ++s) {
      node.stages.push_back(read_stage({static_cast<FuncId>(id), static_cast<int16_t>(s)}, before));
      for (const Access& read : node.stages.back().reads) {
        if (read.of < 0 || read.of == read.by.func) continue;
        auto& consumers = consumers_[static_cast<size_t>(read.of)];
        if (consumers.empty() || consumers.back() != read.by) consumers.push_back(read.by);
      }
    }
  }
}

namespace {

// Whether a stage was read from an equal definition.
bool is_read_from(const StageNode& stage, const FuncContents& f, const Definition& definition) {
  const auto is_same = [](const Iterator& a, const Iterator& b) {
    return a.name == b.name && a.kind == b.kind && a.dimension == b.dimension &&
           ir::equal(a.min, b.min) && ir::equal(a.extent, b.extent);
  };
  const auto are_equal = [](const Expr& a, const Expr& b) { return ir::equal(a, b); };
  return std::ranges::equal(stage.definition, expressions_of(definition), are_equal) &&
         std::ranges::equal(stage.iterators, iterators_of(f, definition), is_same);
}

}  // namespace

StageNode AccessGraph::read_stage(StageId id, AccessGraph& before) {
  const FuncContents& f = *func(id.func).func;
  const FuncId known = f.is_extern() ? -1 : before.find(f.name);
  if (known >= 0) {
    std::vector<StageNode>& stages = before.funcs_[static_cast<size_t>(known)].stages;
    const auto s = static_cast<size_t>(id.stage);
    if (s < stages.size() && is_read_from(stages[s], f, f.stage(id.stage)) &&
        renumber(stages[s], id, before))
      return std::move(stages[s]);
  }
  StageReader reader({ids_, image_ids_}, numbers_, f, id);
  StageNode result = reader.read();
  nodes_visited_ += reader.nodes_visited();
  return result;
}

// Gives what a stage of the graph before accesses the numbers of this graph.
bool AccessGraph::renumber(StageNode& stage, StageId id, const AccessGraph& before) const {
  const auto number = [&](const Access& access) {
    return access.of >= 0 ? find(before.func(access.of).func->name)
                          : find_image(before.images()[static_cast<size_t>(access.image)].get());
  };
  if (std::ranges::any_of(stage.reads, [&](const Access& read) { return number(read) < 0; }))
    return false;
  const auto change = [&](Access& access) {
    (access.of >= 0 ? access.of : access.image) = number(access);
    access.by = id;
  };
  stage.id = id;
  change(stage.write);
  std::ranges::for_each(stage.reads, change);
  return true;
}

FuncId AccessGraph::find(const std::string& func) const {
  return ir::value_or(ids_by_name_, func, -1);
}

FuncId AccessGraph::find(const Symbol* func) const { return ir::value_or(ids_, func, -1); }

ImageId AccessGraph::find_image(const Symbol* image) const {
  return ir::value_or(image_ids_, image, -1);
}

}  // namespace retrograde::planning
