// A pure stage has one iterator for each dimension, so the index of the outer access in a dimension replaces the
// iterator of the inner one.
#include "autoschedule/access/compose.h"

#include <algorithm>
#include <functional>
#include <unordered_map>

#include "ir/build.h"

namespace retrograde::planning {

namespace {

bool is_iterator(const IndexForm& form) {
  return form.terms.size() == 1 && form.terms[0].coefficient == 1 && form.is_affine() &&
         form.low == 0 && form.high == 0;
}

// Reads of different places.
class DistinctReads {
 public:
  void add(Access read) {
    const size_t hash = read.place_hash();
    const auto [first, last] = by_hash_.equal_range(hash);
    for (auto like = first; like != last; ++like) {
      Access& known = reads[like->second];
      if (!known.same_place(read)) continue;
      known.components |= read.components;
      if (!known.guard.is_empty()) known.guard = intersection(known.guard, read.guard);
      return;
    }
    by_hash_.emplace(hash, reads.size());
    reads.push_back(std::move(read));
  }
  std::vector<Access> reads;

 private:
  std::unordered_multimap<size_t, size_t> by_hash_;
};

}  // namespace

ComposedReads::ComposedReads(const AccessGraph& graph, const std::vector<bool>& inlined,
                             size_t most_reads) {
  const auto is_inlined = [&](FuncId func) { return inlined[static_cast<size_t>(func)]; };
  ReadComposer composer(graph, most_reads);
  for (const FuncNode& node : graph.funcs()) {
    for (const StageNode& stage : node.stages) {
      if (!is_inlined(stage.id.func)) found_.emplace(stage.id, composer.compose(stage, is_inlined));
    }
  }
}

size_t ComposedReads::elements_of(StageId stage, FuncId inlined) const {
  const auto* elements = ir::find_or_null(found_.at(stage).elements, inlined);
  return elements ? elements->size() : 0;
}

ReadComposer::ReadComposer(const AccessGraph& graph, size_t most_reads)
    : graph_(graph), most_reads_(most_reads), numbers_(graph.numbers()) {}

// Consumers before producers: all reads of a Func are known when it is its turn.
ReadComposer::Composed ReadComposer::compose(const StageNode& stage,
                                             ir::FunctionRef<bool(FuncId)> is_inlined) {
  Composed found;
  DistinctReads stored;
  std::map<FuncId, DistinctReads, std::greater<>> pending;
  const auto add = [&](Access read) {
    DistinctReads& reads = read.of >= 0 && is_inlined(read.of) ? pending[read.of] : stored;
    reads.add(std::move(read));
  };
  for (const Access& read : stage.reads) add(read);
  size_t composed = 0;
  while (!pending.empty()) {
    const FuncId func = pending.begin()->first;
    std::vector<Access> reads = std::move(pending.begin()->second.reads);
    pending.erase(pending.begin());
    for (const Access& outer : reads) {
      for (const Access& inner : graph_.func(func).stages[0].reads) {
        found.is_complete = found.is_complete && composed < most_reads_;
        if (found.is_complete) add(compose(inner, outer));
        ++composed;
      }
    }
    found.elements[func] = std::move(reads);
  }
  found.reads = std::move(stored.reads);
  return found;
}

Access ReadComposer::compose(const Access& inner, const Access& outer) {
  Access result;
  result.by = outer.by;
  result.of = inner.of;
  result.image = inner.image;
  result.components = inner.components;
  for (const IndexForm& form : inner.index) result.index.push_back(compose(form, outer));
  const bool has_data = std::ranges::any_of(result.index, &IndexForm::has_data);
  if (inner.place.defined())
    result.place = compose(inner.place, outer);
  else if (has_data)
    result.place = outer.place;
  result.guard = compose(inner.guard, outer);
  for (const Congruence& c : outer.guard.congruences) result.guard.congruences.push_back(c);
  ir::append(result.guard.nonnegative, outer.guard.nonnegative);
  ir::append(result.guard.others, outer.guard.others);
  result.through = outer.through;
  result.through.push_back(outer.of);
  return result;
}

IndexForm ReadComposer::compose(const IndexForm& inner, const Access& outer) {
  auto parts = compose_parts(inner, outer);
  if (parts && inner.divisor != 1) parts = quotient(*parts, inner.divisor);
  if (parts && inner.modulus != 0) parts = remainder(*parts, inner.modulus);
  IndexForm result;
  if (parts) {
    result = std::move(*parts);
  } else {  // not of this form: its range is known alone
    result = opaque_form({compose(value_of(inner), outer), 1, inner.within, {}});
  }
  const Term* only = inner.terms.size() == 1 && inner.is_affine() ? &inner.terms[0] : nullptr;
  result.within = inner.within;
  if (only && only->coefficient == 1 && !inner.clamped) {
    const IndexForm& moved = outer.index[static_cast<size_t>(only->iterator)];
    const auto shifted = [](const Expr& end, int64_t by) {
      return end.defined() && by != 0 ? end + make_const(end.type(), by) : end;
    };
    result.within = {shifted(moved.within.min, inner.low), shifted(moved.within.max, inner.high)};
  }
  result.clamped = result.clamped || inner.clamped;
  result.turned = result.turned || inner.turned;
  return result;
}

// Without the divisor and the modulus.
std::optional<IndexForm> ReadComposer::compose_parts(const IndexForm& inner, const Access& outer) {
  IndexForm constant;
  constant.low = inner.low;
  constant.high = inner.high;
  std::optional<IndexForm> result = constant;
  for (const Term& term : inner.terms) {
    const auto part = scaled(outer.index[static_cast<size_t>(term.iterator)], term.coefficient);
    result = part && result ? plus(*result, *part) : std::nullopt;
  }
  for (const OpaqueTerm& term : inner.opaque) {
    OpaqueTerm composed = term;
    composed.value = compose(term.value, outer);
    composed.expr = {};
    if (result) result = plus(*result, opaque_form(composed));
  }
  return result;
}

// If iterators are replaced by iterators, the number stays.
Value ReadComposer::compose(const Value& inner, const Access& outer) {
  Value renamed{inner.number, inner.from_data, {}};
  std::vector<Value> parts;
  bool is_renaming = true;
  for (const int16_t i : inner.iterators) {
    const IndexForm& form = outer.index[static_cast<size_t>(i)];
    const bool is_new =
        is_iterator(form) &&
        std::ranges::find(renamed.iterators, form.terms[0].iterator) == renamed.iterators.end();
    is_renaming = is_renaming && is_new;
    if (is_new) renamed.iterators.push_back(form.terms[0].iterator);
    parts.push_back(value_of(form));
  }
  if (is_renaming) return renamed;
  Value result = numbers_.combine({composed_key, inner.number}, pointers_to(parts));
  result.from_data |= inner.from_data;
  return result;
}

Value ReadComposer::value_of(const IndexForm& form) {
  if (is_iterator(form)) return ValueNumbers::iterator(form.terms[0].iterator);
  return planning::value_of(form, numbers_, [](const OpaqueTerm& term) { return term.value; });
}

Guard ReadComposer::compose(const Guard& inner, const Access& outer) {
  Guard result;
  for (const Congruence& c : inner.congruences)
    result.congruences.push_back({compose(c.form, outer), c.remainder, c.modulus});
  for (const IndexForm& form : inner.nonnegative)
    result.nonnegative.push_back(compose(form, outer));
  for (const Value& other : inner.others) result.others.push_back(compose(other, outer));
  return result;
}

}  // namespace retrograde::planning
