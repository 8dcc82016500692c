// An intermediate of rfactor takes over the reads of the update that it came from; its terms are
// kept only for what they read, not for their variables.
#include "testing/derived_funcs.h"

#include <algorithm>

#include "testing/build_pipeline.h"

namespace retrograde::fuzz {

namespace {

using DerivedKind = DerivedFunc::Kind;

Index plain_index(int variable) {
  Index index;
  index.variable = variable;
  return index;
}

Term read_of(int func, const FuncSpec& spec, int element) {
  Term read;
  read.action = Action::Func;
  read.source = func;
  read.element = element;
  read.type = spec.values[element].type;
  for (int d = 0; d < spec.dimensions; ++d) read.indices.push_back(plain_index(d));
  return read;
}

class Extender {
 public:
  Extender(const PipelineSpec& pipeline, const std::vector<DerivedFunc>& derived)
      : result_{pipeline, {}}, derived_(derived) {}

  ExtendedPipeline run() {
    for (const DerivedFunc& derived : derived_) {
      funcs().emplace_back();
      if (derived.kind == DerivedKind::Wrapper || derived.kind == DerivedKind::Clone) copy(derived);
      if (derived.kind == DerivedKind::Factored) factor(derived);
    }
    return std::move(result_);
  }

 private:
  std::vector<FuncSpec>& funcs() { return result_.pipeline.funcs; }
  int newest() { return static_cast<int>(funcs().size()) - 1; }

  void copy(const DerivedFunc& derived) {
    const FuncSpec source = funcs()[derived.source];
    FuncSpec func = source;
    if (derived.kind == DerivedKind::Wrapper) {
      func.updates.clear();
      for (size_t v = 0; v < func.values.size(); ++v) {
        func.values[v] = read_of(derived.source, source, static_cast<int>(v));
      }
    }
    for (int g = 0; g < newest(); ++g) {
      if (derived.consumer < 0 || derived.consumer == g) redirect(funcs()[g], derived.source);
    }
    funcs().back() = std::move(func);
  }

  void redirect(FuncSpec& user, int source) {
    const int target = newest();
    for (size_t s = 0; s <= user.updates.size(); ++s) {
      for_each_term_of_stage(user, static_cast<int>(s), [&](Term& term) {
        if (term.action == Action::Func && term.source == source) term.source = target;
      });
    }
  }

  void factor(const DerivedFunc& derived) {
    FuncSpec& source = funcs()[derived.source];
    UpdateSpec& update = source.updates[derived.stage - 1];
    const Loops loops = after_split(initial_loops(source, derived.stage), derived);
    FuncSpec partial = source;
    partial.dimensions += static_cast<int>(derived.variables.size());
    partial.updates = {update};
    for (Term& value : partial.values) {  // the identity of the operator
      const Type type = value.type;
      value = {};
      value.type = type;
    }
    const int id = newest();
    const auto [kept, left] = separate(loops, derived);
    Loops pure = initial_loops(source, 0);
    result_.loops[{id, 0}] = pure;
    result_.loops[{id, 1}] = left;
    for (const std::string& name : derived.variables) {
      for (const int stage : {0, 1}) result_.loops[{id, stage}].push_back({name});
    }
    combine(source, update, id, partial);
    result_.loops[{derived.source, derived.stage}] = kept;
    auto& merged = result_.loops[{derived.source, derived.stage}];
    merged.insert(merged.end(), pure.begin(), pure.end());
    funcs().back() = std::move(partial);
  }

  static Loops after_split(Loops loops, const DerivedFunc& derived) {
    if (derived.factor == 0) return loops;
    const auto old = std::find_if(loops.begin(), loops.end(),
                                  [&](const Loop& l) { return l.name == derived.split_loop; });
    Loop outer = *old, inner = *old;
    outer.name = derived.outer;
    inner.name = derived.inner;
    outer.extent = (old->extent + derived.factor - 1) / derived.factor;
    inner.extent = derived.factor;
    outer.is_original = inner.is_original = false;
    *old = outer;
    loops.insert(old, inner);
    return loops;
  }

  // Reduction loops that the update keeps; everything else.
  static std::pair<Loops, Loops> separate(const Loops& loops, const DerivedFunc& derived) {
    Loops kept, left;
    for (Loop loop : loops) {
      const bool keeps = std::count(derived.preserved.begin(), derived.preserved.end(), loop.name);
      if (loop.is_reduction) loop.is_independent = false;
      (keeps ? kept : left).push_back(loop);
    }
    return {kept, left};
  }

  // f(x) = f(x) op partial(x, r)
  static void combine(const FuncSpec& source, UpdateSpec& update, int id, const FuncSpec& partial) {
    for (size_t v = 0; v < update.values.size(); ++v) {
      Term self = read_of(0, source, static_cast<int>(v));
      self.action = Action::Self;
      update.values[v].operands = {self, read_of(id, partial, static_cast<int>(v))};
    }
    update.left = update.values[0].operands[0].indices;
    update.predicate.clear();
  }

  ExtendedPipeline result_;
  const std::vector<DerivedFunc>& derived_;
};

class Deriver {
 public:
  Deriver(const PipelineSpec& pipeline, Random& random, LoopNames& names)
      : pipeline_(pipeline),
        random_(random),
        names_(names),
        reachable_(reachable_funcs(pipeline)),
        built_(build(pipeline)) {}

  std::vector<DerivedFunc> run() {
    for (int f = 0; f < count(); ++f) {
      if (!reachable_[f]) continue;
      if (random_.chance(8)) wrap(f);
    }
    for (int f = 0; f < count(); ++f) {
      for (int s = 1; s <= static_cast<int>(pipeline_.funcs[f].updates.size()); ++s) {
        if (reachable_[f] && random_.chance(35)) factor(f, s);
      }
    }
    return std::move(derived_);
  }

 private:
  int count() const { return static_cast<int>(pipeline_.funcs.size()); }

  // Only the Funcs themselves tell, because constants fold when terms become expressions.
  bool reads(int user, int f) const {
    const auto callees = ir::direct_callees(*built_.funcs[user].function());
    return std::find(callees.begin(), callees.end(), built_.funcs[f].function()) != callees.end();
  }

  void wrap(int f) {
    std::vector<int> users;
    for (int g = 0; g < count(); ++g) {
      if (reachable_[g] && reads(g, f)) users.push_back(g);
    }
    if (users.empty()) return;
    DerivedFunc derived;
    derived.source = f;
    derived.kind = random_.chance(30) ? DerivedKind::Clone : DerivedKind::Wrapper;
    const bool for_all = derived.kind == DerivedKind::Wrapper && random_.chance(40);
    if (!for_all) derived.consumer = random_.pick(users);
    derived_.push_back(derived);
  }

  // Wrappers are made for users by name: those of an update that is cut would go astray.
  bool is_wrapping_user(int f) const {
    return std::any_of(derived_.begin(), derived_.end(),
                       [&](const DerivedFunc& d) { return d.consumer == f || d.source == f; });
  }

  void factor(int f, int stage) {
    const FuncSpec& func = pipeline_.funcs[f];
    if (is_wrapping_user(f) || !is_associative_update(func, stage)) return;
    const std::vector<ReductionRange>& domain = func.updates[stage - 1].domain;
    if (domain.empty()) return;
    DerivedFunc derived;
    derived.kind = DerivedKind::Factored;
    derived.source = f;
    derived.stage = stage;
    const int variable = random_.below(static_cast<int>(domain.size()));
    std::string preserved = reduction_loop(variable);
    if (random_.chance(50)) {
      derived.split_loop = preserved;
      derived.factor = random_.between(2, 4);
      derived.outer = names_.fresh("rro");
      derived.inner = names_.fresh("rri");
      preserved = random_.chance(50) ? derived.outer : derived.inner;
    }
    derived.preserved.push_back(preserved);
    derived.variables.push_back(names_.fresh("u"));
    derived_.push_back(derived);
  }

  const PipelineSpec& pipeline_;
  Random& random_;
  LoopNames& names_;
  const std::vector<bool> reachable_;
  const BuiltPipeline built_;
  std::vector<DerivedFunc> derived_;
};

}  // namespace

std::vector<DerivedFunc> random_derived_funcs(const PipelineSpec& pipeline, Random& random,
                                              LoopNames& names) {
  return Deriver(pipeline, random, names).run();
}

ExtendedPipeline extend(const PipelineSpec& pipeline, const std::vector<DerivedFunc>& derived) {
  return Extender(pipeline, derived).run();
}

}  // namespace retrograde::fuzz
