// Emits the Funcs computed at one place: consumers first, each group of Funcs that share loops once.
#include <algorithm>

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/checks/nest_checks.h"
#include "lower/loops/memoize.h"
#include "lower/nests/emit_definition.h"
#include "lower/nests/nest_emitter.h"
#include "lower/nests/root_statement.h"
#include "lower/storage/promised_bounds.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

// The Funcs of the group that are read here. Others are not computed here, even if they run with the group elsewhere.
std::vector<int> NestEmitter::needed_of(const FusedGroup& group, const Emitted& code) const {
  return filtered(group.funcs, [&](const int f) {
    return program_.funcs[f].is_output || code.uses.count(program_.funcs[f].name());
  });
}

Emitted NestEmitter::emit_place(const std::vector<int>& children, Emitted code,
                                ComputePlace& site) {
  std::vector<Piece> pieces;
  WantedFuncs wanted;
  Stmt inner = code.stmt;
  for (const auto& [name, use] : code.uses) wanted[name] = {};
  for (auto it = children.rbegin(); it != children.rend(); ++it) {
    const FusedGroup& group = groups_[group_of_[*it]];
    if (*it != group.funcs.back()) continue;  // emits each group once
    const std::vector<int> needed = needed_of(group, code);
    if (needed.empty()) continue;
    const bool is_whole = needed.size() == group.funcs.size();
    pieces.push_back(emit_piece(is_whole ? group : part_of(group, needed), code, wanted, site));
  }
  for (const Piece& piece : pieces) code.lead = std::max(code.lead, piece.lead);
  code.stmt = assemble(pieces, inner, code, site);
  return code;
}

namespace {

// The statement, guarded if it starts later than the loop around.
Stmt running_from(int lead, const Stmt& stmt, const Emitted& code, const ComputePlace& site) {
  if (lead == code.lead || !stmt.defined()) return stmt;
  const Loop& loop = site.around[0];
  Expr runs = variable(loop.name) >= simplify(loop.min - lead);
  return make_if(code.has_loops ? runs : likely(runs), stmt);
}

}  // namespace

Stmt NestEmitter::assemble(const std::vector<Piece>& pieces, Stmt stmt, const Emitted& code,
                           const ComputePlace& site) {
  stmt = running_from(0, stmt, code, site);
  for (const Piece& piece : pieces) {
    Stmt produce = piece.produce;
    for (auto f = piece.funcs.rbegin(); f != piece.funcs.rend(); ++f) {
      produce = make_producer_consumer((*f)->name(), true, produce);
      if (stmt.defined()) stmt = make_producer_consumer((*f)->name(), false, stmt);
    }
    stmt = make_block({running_from(piece.lead, produce, code, site), stmt});
    for (const auto& [f, required, allocated] : piece.realized) {
      stmt = storage_.realize(*f, allocated, stmt);
      if (f->schedule.memoized) stmt = with_key_region(f->name(), required, stmt);
    }
  }
  return stmt;
}

Box NestEmitter::take_required(const LoopedFunc& f, Emitted& code, Box& touched,
                               std::vector<Stmt>& checks) {
  Box required;
  if (auto use = code.uses.find(f.name()); use != code.uses.end()) {
    required = use->second.box;
    code.uses.erase(use);
  }
  if (auto more = code.touched.extract(f.name())) {
    const bool has_own_storage =
        !f.is_output && !f.func->is_extern() && !f.schedule.memoized && !f.schedule.async;
    if (has_own_storage)
      touched = more.mapped();
    else
      required = hull(required, more.mapped());
  }
  if (f.is_output) required = output_box(f, required);
  check_bounded(program_, f, required);
  apply_promised_bounds(f, required, checks);
  return required;
}

namespace {

int slide_lead(const std::vector<Slide>& slides, int lead, const ComputePlace& site) {
  for (const Slide& slide : slides) {
    if (slide.loop.name == site.around[0].name) return slide.lead;
  }
  return lead;
}

// Restricts the region of a Func that does not slide over the loop around, beside Funcs that do.
//
// Iterations before the loop's first run only for sliding consumers, which compute parts of the first iteration's
// region. In these iterations the Func computes the first iteration's region, because coordinates of other consumers
// lie outside of every required region. A part may be empty; its ends then lie one element outside of its iteration's
// region. Regions derived from such ends are clamped to the complete region, since storage and inputs hold no more.
// Loops that run beyond a small region, such as tiles shifted inwards, run over the complete region: their reads
// beyond a part would lie outside of it.
void keep_inside_needs(const LoopedFunc& f, Box& required, const std::vector<Slide>& slides,
                       bool is_early, ComputePlace& site) {
  const Loop& loop = site.around[0];
  const Box whole = site.whole(required);
  for (size_t d = 0; d < required.size(); d++) {
    const bool slides_over_it = std::any_of(slides.begin(), slides.end(), [&](const Slide& slide) {
      return slide.dimension == static_cast<int>(d) && slide.loop.name == loop.name;
    });
    if (slides_over_it) continue;
    Interval& side = required[d];
    const bool may_be_empty = site.mentions_parts(side);
    if (is_early) {  // names bound by other Funcs also refer to their own iterations
      side = held_from_first({site.without_names(side.min), site.without_names(side.max)}, loop);
    }
    if (!may_be_empty) continue;
    const auto [first, last] = is_early ? held_from_first(whole[d], loop) : whole[d];
    side = runs_beyond_regions(f, d)
               ? Interval{first, last}
               : Interval{clamp(side.min, first, last), clamp(side.max, first, last)};
  }
}

}  // namespace

// Funcs that share loops begin in the same iteration of the loop around, the earliest that any of them needs. A Func
// that begins earlier may in turn need another to begin earlier still, hence the rounds.
NestEmitter::Wanted NestEmitter::slide_together(std::vector<Member>& members,
                                                const WantedFuncs& wanted,
                                                ComputePlace& site) const {
  Wanted all{0, 0};
  for (size_t i = 0; i < members.size(); i++) {
    const Wanted own = value_or(wanted, members[i].f->name(), {});
    all.first = std::max(all.first, own.first);
    all.last = i == 0 ? own.last : std::min(all.last, own.last);
  }
  const bool slides = options_.slide && !site.around.empty();
  for (size_t round = 0; slides && round <= members.size() + 1; round++) {
    const int lead = all.first;
    for (Member& member : members) {
      member.slides.clear();
      const bool is_last_round = round > members.size();  // they do not agree
      if (!member.loops.empty() && !is_last_round)
        member.slides =
            slides_of(*member.f, site.whole(member.need), member.loops, site.around, lead);
      // Beyond the region, the first stage would overwrite finished elements with their initial values.
      if (member.f->stages.size() > 1 && keeps_beside_its_regions(member, site))
        member.slides.clear();
      all.first = std::max(all.first, slide_lead(member.slides, lead, site));
    }
    if (all.first == lead || members.size() == 1) break;
  }
  return all;
}

// Whether a Func may be computed from undefined values where its own values do not matter.
static bool may_have_wrong_values(const LoopedFunc& f, const ValueBounds& values) {
  return !f.func->is_extern() && f.stages.size() == 1 && is_stored_where_computed(f) &&
         !f.schedule.memoized && !f.schedule.async && tolerates_any_values(f.stages[0], values);
}

// Computes a group: removes it from the uses of `code`, and adds the needs of the group itself.
NestEmitter::Piece NestEmitter::emit_piece(const FusedGroup& group, Emitted& code,
                                           WantedFuncs& wanted, ComputePlace& site) {
  Piece piece;
  std::vector<Stmt> checks;
  std::vector<Member> members;
  for (const int index : group.funcs) {
    const LoopedFunc& f = program_.funcs[index];
    piece.funcs.push_back(&f);
    Box touched;
    Box required = take_required(f, code, touched, checks);
    members.push_back(
        {&f, std::move(required), loops_to_storage(f, site), {}, {}, std::move(touched)});
  }
  const Wanted want = slide_together(members, wanted, site);
  piece.lead = want.first;
  for (Member& member : members) {
    if (!site.around.empty())
      keep_inside_needs(*member.f, member.need, member.slides, want.first > 0, site);
  }
  for (Member& member : members) member.required = member.need;
  Emitted generated = emit_members(group, members, site, std::move(checks));
  std::map<std::string, Box> allocated = std::move(generated.storage);
  generated.storage.clear();
  for (Member& member : members) {
    auto own = allocated.extract(member.f->name());
    member.need = hull(own.mapped(), member.touched);
  }
  generated.storage = std::move(allocated);
  for (const auto& [name, use] : generated.uses) {
    auto [it, is_first] = wanted.emplace(name, Wanted{piece.lead, piece.lead});
    if (is_first || !code.uses.count(name)) it->second = {piece.lead, piece.lead};
    it->second.first = std::max(it->second.first, piece.lead);
    it->second.last = std::min(it->second.last, piece.lead);
  }
  for (const Member& member : members) {
    code.overrun.counts |= !may_have_wrong_values(*member.f, values_);
    code.overrun.inside.push_back(member.f);
  }
  merge_code(code, generated);
  if (site.around.empty()) ask_wholes(code, site);
  for (Member& member : members) keep(member, member.need, code, generated, piece, site);
  piece.produce = members.size() == 1 ? unless_empty(members[0], generated.stmt) : generated.stmt;
  return piece;
}

// Skips the loops of a Func while its part is empty, if other Funcs are computed inside these loops: their regions
// follow from the ends of the part, which are reversed then.
Stmt NestEmitter::unless_empty(const Member& member, const Stmt& stmt) const {
  const bool has_children = std::any_of(at_.begin(), at_.end(), [&](const auto& entry) {
    return entry.first.first == member.f->name();
  });
  Expr has_elements = const_true();
  for (const Slide& slide : member.slides) {
    const Interval& part = slide.part;
    if (is_const(simplify(part.max - part.min + 1))) continue;
    const std::string end =
        stage_prefix(member.f->name(), static_cast<int>(member.f->stages.size()) - 1) +
        member.f->func->args[slide.dimension];
    has_elements = has_elements && variable(end + ".min") <= variable(end + ".max");
  }
  return has_children && !is_const_true(has_elements) ? make_if(has_elements, stmt) : stmt;
}

// Decides on the storage of a computed Func.
void NestEmitter::keep(Member& member, Box allocated, Emitted& code, Emitted& generated,
                       Piece& piece, ComputePlace& site) {
  const LoopedFunc& f = *member.f;
  if (f.is_output) {
    outputs_[f.name()] = allocated;
    return;
  }
  Box touched = hull(member.required, allocated);
  generated.stmt = storage_.fold(f, touched, member.loops, member.slides, code.has_vectors, site,
                                 generated.stmt);
  if (f.schedule.async && !member.loops.empty())
    storage_.note_lead(f, member.loops, member.slides, site.touched(touched));
  if (is_stored_where_computed(f)) {
    piece.realized.push_back({&f, member.required, allocated});
    storage_.note_place(f, allocated, code.storage);
  } else {
    code.storage[f.name()] = hull(code.storage[f.name()], allocated);
  }
}

Box NestEmitter::output_box(const LoopedFunc& f, const Box& read) {
  check_storage_of_output(f);
  outputs_[f.name()] = read;  // consumers' reads must lie inside, too
  return buffer_box(value_buffer_name(*f.func, 0), f.func->dimensions());
}

}  // namespace retrograde::lower
