// Builds an access graph from the definitions of a program.
#include <algorithm>

#include "autoschedule/access/access_graph.h"
#include "autoschedule/access/stage_reader.h"
#include "graph/directives/wrappers.h"

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

AccessGraph::AccessGraph(const std::vector<FuncPtr>& outputs) {
  const std::vector<FuncPtr> wrapped = apply_wrappers(outputs);
  for (const auto& parameter : parameters_of(wrapped)) {
    if (!parameter->is_buffer) continue;
    image_ids_.emplace(parameter.get(), static_cast<ImageId>(images_.size()));
    images_.push_back(parameter);
  }
  for (const FuncPtr& f : topological_order(wrapped)) {
    ids_.emplace(f.get(), static_cast<FuncId>(funcs_.size()));
    funcs_.push_back({f, std::ranges::find(wrapped, f) != wrapped.end(), {}});
  }
  const Names names{ids_, image_ids_};
  consumers_.resize(funcs_.size());
  for (size_t id = 0; id < funcs_.size(); ++id) {
    FuncNode& node = funcs_[id];
    for (int s = 0; s < node.func->stage_count(); ++s) {
      StageReader reader(names, numbers_, *node.func,
                         {static_cast<FuncId>(id), static_cast<int16_t>(s)});
      node.stages.push_back(reader.read());
      nodes_visited_ += reader.nodes_visited();
      for (const Access& read : node.stages.back().reads) {
        if (read.of < 0 || read.of == read.by.func) continue;
        auto& consumers = consumers_[static_cast<size_t>(read.of)];
        if (consumers.empty() || consumers.back() != read.by) consumers.push_back(read.by);
      }
    }
  }
}

FuncId AccessGraph::find(const Symbol* func) const { return ir::value_or(ids_, func, -1); }

ImageId AccessGraph::find_image(const Symbol* image) const {
  return ir::value_or(image_ids_, image, -1);
}

}  // namespace retrograde::planning
