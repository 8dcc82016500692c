#include "lower/loops/stage_needs.h"

#include <algorithm>

#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr const char* need_suffix = ".needed";

std::string need_of(const std::string& func) { return func + need_suffix; }

// Whether the statement computes a single point and calls no C function, which may take long.
bool is_one_point(const Stmt& s) {
  return !any_node(
      s,
      [](const Expr& e) {
        const auto* call = e.as<Call>();
        return call && call->call_type == CallType::Extern;
      },
      [](const Stmt& part) {
        const auto* loop = part.as<For>();
        return loop && !is_one(simplify(loop->extent));
      });
}

// Whether the producer contains kernels, or computes Funcs stored elsewhere.
bool computes_others(const Stmt& producer) {
  std::set<std::string> own{producer.as<ProducerConsumer>()->name};
  bool result = false;
  walk(
      producer, [](const Expr&) { return false; },
      [&](const Stmt& part) {
        if (const auto* storage = part.as<Realize>()) own.insert(storage->name);
        if (const auto* store = part.as<Provide>()) result |= !own.contains(store->name);
        if (const auto* loop = part.as<For>()) result |= is_gpu(loop->runs);
        return !result;
      });
  return result;
}

}  // namespace

Expr StageNeeds::is_needed(const std::string& func) { return variable(need_of(func), Bool()); }

void StageNeeds::begin(const std::string& func, std::set<std::string> complete) {
  stages_.emplace(func, Stage{.outside = enclosing_.depth(),
                              .complete = std::move(complete),
                              .needed = const_false()});
}

void StageNeeds::add_producer(const std::string& func, const Stmt& producer) {
  stages_.at(func).producers.push_back(producer);
}

void StageNeeds::add_read(const std::string& func) {
  const auto found = stages_.find(func);
  if (found == stages_.end()) return;
  Stage& stage = found->second;
  stage.is_read = true;
  if (is_const_true(stage.needed)) return;
  const Expr where = condition_of_read(stage);
  stage.needed = either(stage.needed, where);
  note_mentions(where, func);
}

Expr StageNeeds::condition_of_read(const Stage& stage) const {
  Expr where = const_true();
  enclosing_.for_each_since(stage.outside, [&](const EnclosingCondition& enclosing,
                                               const Expr& seen) {
    // Under another guard, a read in the condition may be out of bounds where that guard does not hold.
    const bool is_outermost = enclosing.outside.guards == stage.outside.guards;
    where = both(where, without_reads(seen, [&](const Call& call) {
                   return is_outermost && !enclosing_.is_in_kernel() &&
                          (call.call_type == CallType::Image || stage.complete.contains(call.name));
                 }));
  });
  // A select evaluates C functions in its condition always, so the call can be moved; elsewhere it stays.
  return enclosing_.is_conditional_since(stage.outside) ? without_calls(where) : where;
}

void StageNeeds::note_mentions(const Expr& where, const std::string& func) {
  walk(where, [&](const Variable& v) {
    const size_t mark = v.name.rfind(need_suffix);
    if (mark == std::string::npos) return;
    const auto other = stages_.find(v.name.substr(0, mark));
    if (other != stages_.end()) other->second.mentioned_by.insert(func);
  });
}

// The storage of the Func ends here, so all of its reads are known.
void StageNeeds::end(const std::string& func) {
  const Stage stage = std::move(stages_.at(func));
  stages_.erase(func);
  Expr need = need_outside(stage);
  // A single point is decided now, because its condition determines where the Funcs that it reads are needed. Parts
  // that are not settled yet count as true.
  if (std::ranges::any_of(stage.producers, is_one_point)) {
    need = simplify(without_parts_of(need, unsettled()));
    if (enclosing_.varies(need)) need = const_true();
  }
  replace_in_outer(func, need, stage);
  open_needs_[func] = need;
  settle(func);
}

// The condition outside of the Func's storage; true if a condition may be wrong there.
Expr StageNeeds::need_outside(const Stage& stage) const {
  if (!stage.is_read || is_const_true(stage.needed)) return const_true();
  if (std::ranges::any_of(stage.producers, computes_others)) return const_true();
  return simplify(enclosing_.without_lanes(stage.needed));
}

// Replaces the Func's placeholder in the conditions of Funcs whose storage is still open.
void StageNeeds::replace_in_outer(const std::string& func, const Expr& need, const Stage& stage) {
  for (const std::string& reader : stage.mentioned_by) {
    const auto outer = stages_.find(reader);
    if (outer == stages_.end()) continue;
    const Expr seen = enclosing_.seen_from(outer->second.outside, without_reads(need));
    outer->second.needed = simplify(substitute(outer->second.needed, need_of(func), seen));
    note_mentions(seen, reader);
  }
}

// A condition that mentions Funcs whose storage is still open is settled when that storage ends. Only then is it known
// where those Funcs are computed, and so where they read this one.
void StageNeeds::settle(const std::string& func) {
  const Expr need = open_needs_.at(func);
  if (uses_any_variable(need, unsettled())) return;
  open_needs_.erase(func);
  if (!is_const_true(need)) guards_[func] = need;
  std::vector<std::string> waiting;
  for (auto& [name, other] : open_needs_) {
    if (!uses_variable(other, need_of(func))) continue;
    other = simplify(substitute(other, need_of(func), need));
    waiting.push_back(name);
  }
  for (const std::string& name : waiting) {
    if (open_needs_.contains(name)) settle(name);
  }
}

// The placeholders whose conditions are not final.
std::unordered_set<std::string> StageNeeds::unsettled() const {
  std::unordered_set<std::string> names;
  for (const auto& [name, stage] : stages_) names.insert(need_of(name));
  for (const auto& [name, need] : open_needs_) names.insert(need_of(name));
  return names;
}

}  // namespace retrograde::lower
