#include "autodiff/updates/self_reads.h"

#include <algorithm>
#include <map>
#include <set>

#include "autodiff/time/checkpoint.h"
#include "autodiff/updates/versions.h"
#include "ir/build.h"

namespace retrograde::autodiff {

std::optional<std::vector<SelfRead>> find_self_reads(const UpdateContext& context,
                                                     UpdateRelations& relations) {
  std::vector<SelfRead> reads;
  for (const Expr& call : context.self_reads()) {
    auto relation = relations.read(as_call_of(call, context.f)->args);
    if (!relation) return std::nullopt;
    reads.push_back({call, *relation});
  }
  return reads;
}

void mark(std::vector<SelfRead>& reads, const UpdateContext& context, const SweepResult& sweep) {
  std::set<Expr, StructuralLess> carrying;
  for (const LeafAdjoint& leaf : sweep.leaves) {
    if (as_call_of(leaf.leaf, context.f)) carrying.insert(leaf.leaf);
  }
  const std::vector<Expr> needed = context.needed_reads(sweep);
  for (SelfRead& r : reads) {
    r.carries_adjoint = carrying.contains(r.call);
    r.is_needed = std::ranges::any_of(needed, [&](const Expr& e) { return equal(e, r.call); });
  }
}

bool keep_needed_values(const std::vector<SelfRead>& reads, const UpdateContext& context,
                        const UpdateRelations& relations, UpdateAdjoint& result) {
  std::map<int, FuncPtr> prefixes;
  const auto prefix = [&](int stages) -> const FuncPtr& {
    FuncPtr& copy = prefixes[stages];
    if (!copy) copy = clone_prefix(context.query.f, stages);
    return copy;
  };
  for (const SelfRead& r : reads) {
    if (!r.is_needed) continue;
    const auto* call = r.call.as<Call>();
    bool later = is_written_later(context, relations, r.relation);
    if (!later && !r.relation.overwritten) continue;
    if (wants_checkpoints(context)) return false;
    context.check_versions_are_kept(r.call);
    Expr after = later ? call_value(prefix(context.query.stage + 1), call->args, call->component)
                       : call_value(context.query.f, call->args, call->component);
    Expr before = call_value(prefix(context.query.stage), call->args, call->component);
    result.self_values[r.call] = r.relation.never_new ? before
                                 : r.relation.always_new
                                     ? after
                                     : make_select(r.relation.sees_new_condition, after, before);
    context.note(
        text(": the value of ", point_text(context.f->name, call->args), " is kept in a copy"),
        result);
  }
  for (const auto& [stages, copy] : prefixes) context.take_room(copy, context.extents(), result);
  return true;
}

Inversion inverted(const UpdateContext& context, const Call& call,
                   const UpdateRelations::Read& relation, bool to_new) {
  Expr condition = relation.sees_new_condition;
  if (!to_new) condition = logical_not(condition);
  if (to_new ? relation.always_new : relation.never_new) condition = const_true();
  AccessQuery query{restricted(context.domain, condition), call.args, context.query.target.args,
                    context.query.target.region};
  query.narrows =
      !to_new;  // terms without a sum are added in its first iteration, so it must not be empty
  return invert_access(query);
}

namespace {

// Merges equal reads and adds their adjoints, so that there is one domain to sum over.
std::vector<LeafAdjoint> self_leaves(const UpdateContext& context, const SweepResult& sweep) {
  std::vector<LeafAdjoint> result;
  for (const LeafAdjoint& leaf : sweep.leaves) {
    if (!as_call_of(leaf.leaf, context.f)) continue;
    auto known = std::ranges::find_if(
        result, [&](const LeafAdjoint& l) { return equal(l.leaf, leaf.leaf); });
    if (known == result.end()) {
      result.push_back(leaf);
    } else {
      known->adjoint = known->adjoint + leaf.adjoint;
    }
  }
  return result;
}

}  // namespace

std::vector<Contribution> self_contributions(const std::vector<SelfRead>& reads,
                                             const UpdateContext& context, const SweepResult& sweep,
                                             const SelfValues& self_values, bool to_new) {
  std::vector<Contribution> result;
  for (const LeafAdjoint& leaf : self_leaves(context, sweep)) {
    const Call* call = as_call_of(leaf.leaf, context.f);
    auto read =
        std::ranges::find_if(reads, [&](const SelfRead& r) { return equal(r.call, leaf.leaf); });
    const UpdateRelations::Read& relation = read->relation;
    if (to_new ? relation.never_new : relation.always_new) continue;
    Expr adjoint = with_values(leaf.adjoint, context.query.f, self_values);
    for (const Gather& g : inverted(context, *call, relation, to_new).gathers)
      result.push_back({call->component, g, substitute(adjoint, g.iteration)});
  }
  return result;
}

bool is_written_later(const UpdateContext& c, const UpdateRelations& relations,
                      const UpdateRelations::Read& read) {
  for (int s = c.query.stage + 1; s < c.f->stage_count(); ++s) {
    IterationDomain domain = c.query.regions.domain(*c.query.f, s);
    if (relations.may_write(read, domain, c.f->stage(s).args)) return true;
  }
  return false;
}

FinalValues::FinalValues(const UpdateContext& context) : c_(context) {
  try {
    relations_ = std::make_unique<UpdateRelations>(c_.domain, c_.write, c_.pure);
  } catch (const isl::exception&) {
    relations_ = nullptr;
  }
}

bool FinalValues::contains(const Expr& e) {
  if (!relations_ || !relations_->write_is_affine()) return false;
  try {
    auto read = relations_->read(as_call_of(e, c_.f)->args);
    return read && !read->overwritten && !is_written_later(c_, *relations_, *read);
  } catch (const isl::exception&) {
    return false;
  }
}

}  // namespace retrograde::autodiff
