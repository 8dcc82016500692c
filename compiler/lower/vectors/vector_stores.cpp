#include "lower/vectors/vector_stores.h"

#include <cstdlib>

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::lower {

namespace {

int own_loads(const Store& n) {
  int count = 0;
  const auto note = [&](const Load& load) { count += load.name == n.name; };
  walk(n.value, note);
  walk(n.index, note);
  return count;
}

void find_facts(const Stmt& s, BodyFacts& facts) {
  if (!s.defined()) return;
  if (const Allocate* a = s.as<Allocate>()) facts.buffers[a->name].is_allocated = true;
  if (const Store* store = s.as<Store>()) {
    BufferFacts& buffer = facts.buffers[store->name];
    ++buffer.stores;
    if (auto update = find_atomic_update(*store)) {
      buffer.update_loads += own_loads(*store);
      buffer.update_operations.insert({update->kind, update->op});
    }
  }
  const ProducerConsumer* p = s.as<ProducerConsumer>();
  if (p && p->produces) facts.produced.insert(p->name);
  for_each_child(
      s,
      [&](const Expr& e) { walk(e, [&](const Load& load) { ++facts.buffers[load.name].loads; }); },
      [&](const Stmt& child) { find_facts(child, facts); });
}

// Whether a Func is computed and updated in every iteration, in storage that all iterations share. Where the regions
// of two iterations overlap, one initialises again what the other has updated, so they must not be interleaved.
bool recomputes_shared_updates(const BodyFacts& facts) {
  for (const auto& [name, buffer] : facts.buffers) {
    if (buffer.stores < 2 || buffer.is_allocated) continue;
    if (facts.produced.count(name) || facts.produced.count(name.substr(0, name.rfind('.'))))
      return true;
  }
  return false;
}

// In a nest of ramps with known strides, the step of one ramp must exceed the whole range of the other.
bool hits_each_element_once(const Expr& index) {
  const Ramp* ramp = index.as<Ramp>();
  if (!ramp || is_zero(ramp->stride)) return false;
  if (ramp->base.type().is_scalar()) return true;
  const Ramp* inner = ramp->base.as<Ramp>();
  if (!inner || !hits_each_element_once(ramp->base)) return false;
  auto outer_step = as_const_int(ramp->stride), inner_step = as_const_int(inner->stride);
  if (!outer_step || !inner_step) return true;
  return std::abs(*outer_step) >= std::abs(*inner_step) * inner->lanes ||
         std::abs(*inner_step) >= std::abs(*outer_step) * ramp->lanes;
}

}  // namespace

VectorStores::VectorStores(const For& loop, Widener& widen, FreshNames& fresh)
    : name_(loop.name), widen_(widen), fresh_(fresh) {
  find_facts(loop.body, facts_);
  must_stay_serial_ = recomputes_shared_updates(facts_);
}

Stmt VectorStores::store(const Stmt& s, const Store& n) {
  int lanes = n.index.type().lanes();
  if (widen_.is_wide_allocation(n.name)) {
    return make_store(n.name, widen_.spread(n.value), widen_.index_in_wide_allocation(n.index),
                      widen_.masked(n.predicate, lanes), n.symbol);
  }
  if (widen_.varies(n.index)) {
    Expr index = widen_(n.index);
    const bool may_meet = !hits_each_element_once(index);
    if (may_meet) {
      if (auto update = as_plain_update(n)) return update_in_order(n, index, *update);
      require_no_load(n.name, 0);
    }
    return make_store(n.name, widen_.spread(n.value), index, widen_.masked(n.predicate, lanes),
                      n.symbol);
  }
  if (auto reduction = find_vector_reduction(n)) return store_reduction(s, n, *reduction);
  require_no_load(n.name, 0);
  bool is_same = !widen_.varies(n.value) && !widen_.varies(n.predicate);
  return is_same ? s : Stmt();  // lane by lane, the last lane's value remains
}

// Several lanes may hit one element, so code generation stores lane by lane.
Stmt VectorStores::atomic_update(const Store& n) {
  require_no_load(n.name, own_loads(n));
  return make_store(n.name, widen_.spread(n.value), widen_(n.index),
                    widen_.masked(n.predicate, n.index.type().lanes()), n.symbol);
}

// Matches f[i] = f[i] op g, if all other loads of f in the body belong to updates by the same operation.
std::optional<AtomicUpdate> VectorStores::as_plain_update(const Store& n) const {
  if (!n.index.type().is_scalar() || n.predicate.defined() || !n.value.type().is_scalar())
    return std::nullopt;
  const BufferFacts& buffer = facts_.buffers.at(n.name);
  if (buffer.loads > buffer.update_loads || buffer.update_operations.size() > 1)
    return std::nullopt;
  return find_atomic_update(n);
}

// Indices and operands are vectors. The elements are updated one after the other in lane order, as several may be the
// same element.
Stmt VectorStores::update_in_order(const Store& n, const Expr& index, const AtomicUpdate& update) {
  Expr operand = widen_.spread(update.operand);
  const std::string places = fresh_(name_ + ".places"), terms = fresh_(name_ + ".terms");
  std::vector<Stmt> stores;
  for (int i = 0; i < widen_.iterations(); ++i) {
    Expr place = extract_iteration(variable(places, index.type()), i, 1);
    Expr term = extract_iteration(variable(terms, operand.type()), i, 1);
    Expr old = make_load(n.value.type(), n.name, place, {}, n.symbol);
    Stmt store = make_store(n.name, updated(update, old, term), place, {}, n.symbol);
    const Expr& mask = widen_.mask();
    stores.push_back(mask.defined() ? make_if(extract_iteration(mask, i, 1), store) : store);
  }
  return make_let(places, index, make_let(terms, operand, make_block(std::move(stores))));
}

// Several lanes store to `buffer`, so nothing in the body may read it except the `own` loads of the store itself.
void VectorStores::require_no_load(const std::string& buffer, int own) {
  must_stay_serial_ |= facts_.buffers.at(buffer).loads > own;
}

Stmt VectorStores::store_reduction(const Stmt& s, const Store& n, const UpdateChain& reduction) {
  require_no_load(n.name, own_loads(n));
  if (must_stay_serial_) return s;
  Expr active =
      widen_.masked(widen_.varies(n.predicate) ? n.predicate : Expr(), n.value.type().lanes());
  Expr result = reduction.own;
  for (const UpdateChain::Term& term : reduction.terms) {
    Expr reduced = reduce(reduction.kind, term.value, active);
    result = binary(term.is_negated ? Kind::Sub : reduction.kind, result, reduced);
  }
  Expr predicate = widen_.varies(n.predicate) ? Expr() : n.predicate;
  return make_store(n.name, result, n.index, predicate, n.symbol);
}

// Reduces the terms of all iterations, separately for each lane of the statement.
Expr VectorStores::reduce(Kind kind, const Expr& term, const Expr& active) {
  int lanes = term.type().lanes();
  Expr wide = widen_.spread(term);
  if (active.defined()) wide = make_select(active, wide, identity_of(kind, wide.type()));
  if (lanes > 1) {  // iteration-major to lane-major: each reduced group becomes contiguous
    std::vector<int> indices;
    for (int lane = 0; lane < lanes; ++lane) {
      for (int iteration = 0; iteration < widen_.iterations(); ++iteration)
        indices.push_back(iteration * lanes + lane);
    }
    wide = make_shuffle({wide}, indices);
  }
  return make_vector_reduce(kind, wide, lanes);
}

}  // namespace retrograde::lower
