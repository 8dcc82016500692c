#include "autodiff/matrices/dependence.h"

#include <algorithm>
#include <optional>
#include <set>

#include "autodiff/inversion/isl_maps.h"
#include "diagnostics/error.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// A relation with more pieces is replaced by its hull; conditions beyond the limit are ignored inside of others. Both
// keep a superset.
constexpr int many_pieces = 24;
constexpr size_t many_conditions = 64;
// Coalescing compares every pair of pieces, so it is skipped beyond this number.
constexpr int most_compared = 64;

unsigned size_of(size_t n) { return static_cast<unsigned>(n); }

// Projects out the parameters.
isl::map without_parameters(const isl::map& m) {
  return isl::manage(isl_map_project_out(m.copy(), isl_dim_param, 0,
                                         size_of(isl_map_dim(m.get(), isl_dim_param))));
}

isl::map hull_of(const isl::map& m) {
  return isl::manage(isl_map_from_basic_map(isl_map_simple_hull(m.copy())));
}

// Reduces the number of pieces; the result is the same set or a superset.
isl::map tidy(const isl::map& m) {
  const int pieces = isl_map_n_basic_map(m.get());
  if (pieces <= 1) return m;
  const isl::map result = pieces <= most_compared ? coalesced(m) : m;
  isl_ctx_reset_operations(
      isl_map_get_ctx(m.get()));  // simplification does not count against the budget
  return isl_map_n_basic_map(result.get()) <= many_pieces ? result : hull_of(m);
}

// One read, with the conditions under which it happens.
struct Read {
  const Call* call;
  std::optional<isl::set> where;  // over the stage's loop variables; nullopt: everywhere
};

// One definition of a Func as relations over its loop variables.
class StageRelations {
 public:
  StageRelations(IslContext& context, const FuncContents& f, int stage)
      : f_(f), definition_(f.stage(stage)), bridge_(context, names(f, f.stage(stage))) {
    domain_ = bridge_.universe();
    for (const ReductionVariable& r : definition_.rvars) {
      isl::pw_aff v = bridge_.dim(position(r.var));
      domain_ = domain_.intersect(v.ge_set(bridge_.bound(r.min)));
      domain_ = domain_.intersect(v.le_set(bridge_.bound(simplify(r.min + r.extent - 1))));
    }
    if (definition_.predicate.defined()) {
      if (auto s = bridge_.condition(without_lets(definition_.predicate)))
        domain_ = domain_.intersect(*s);
    }
  }

  // {element written -> iteration}
  isl::map written_by() { return access(definition_.args, std::nullopt).reverse(); }
  // {iteration -> element read}
  isl::map access(const std::vector<Expr>& indices, const std::optional<isl::set>& where) {
    isl::map result =
        universe_map(bridge_.ctx(), static_cast<size_t>(bridge_.rank()), indices.size());
    for (size_t d = 0; d < indices.size(); ++d) {
      auto index = bridge_.affine(without_lets(indices[d]));
      if (index)
        result = result.intersect(
            output_equals(*index, static_cast<int>(d), static_cast<int>(indices.size())));
    }
    isl::set domain = where ? domain_.intersect(*where) : domain_;
    return without_parameters(result.intersect_domain(domain));
  }

  // The reads of Funcs anywhere in the definition, or in one of its values.
  std::vector<Read> reads(std::optional<size_t> value) {
    if (value) {
      collect(without_lets(definition_.values[*value]));
    } else {
      for_each_expr(definition_, [&](const Expr& e) { collect(without_lets(e)); });
    }
    return std::move(reads_);
  }

 private:
  static std::vector<std::string> names(const FuncContents& f, const Definition& definition) {
    std::vector<std::string> result = f.args;
    for (const ReductionVariable& r : definition.rvars) result.push_back(r.var);
    return result;
  }
  int position(const std::string& rvar) const {
    for (size_t i = 0; i < definition_.rvars.size(); ++i) {
      if (definition_.rvars[i].var == rvar) return static_cast<int>(f_.args.size() + i);
    }
    return 0;
  }

  // Visits each node once for each condition.
  void collect(const Expr& root) {
    conditions_.assign(1, std::nullopt);
    std::set<std::pair<const ExprNode*, size_t>> seen;
    std::vector<std::pair<Expr, size_t>> open = {{root, 0}};
    auto add = [&](const Expr& e, size_t condition) {
      if (seen.insert({e.get(), condition}).second) open.push_back({e, condition});
    };
    while (!open.empty()) {
      auto [e, condition] = open.back();
      open.pop_back();
      if (const auto* call = e.as<Call>(); call && call->call_type == CallType::Func)
        reads_.push_back({call, conditions_[condition]});
      if (const auto* s = e.as<Select>()) {
        add(s->condition, condition);
        auto [yes, no] = split(condition, s->condition);
        add(s->when_true, yes);
        add(s->when_false, no);
        continue;
      }
      for_each_child(e, [&](const Expr& child) { add(child, condition); });
    }
    keep_alive_.push_back(root);
  }

  std::pair<size_t, size_t> split(size_t outer, const Expr& condition) {
    if (conditions_.size() + 2 > many_conditions) return {outer, outer};
    auto set = bridge_.condition(condition);
    if (!set) return {outer, outer};
    isl::set around = conditions_[outer] ? *conditions_[outer] : bridge_.universe();
    conditions_.push_back(around.intersect(*set));
    conditions_.push_back(around.subtract(*set));
    return {conditions_.size() - 2, conditions_.size() - 1};
  }

  const FuncContents& f_;
  const Definition& definition_;
  IslBridge bridge_;
  isl::set domain_;
  std::vector<std::optional<isl::set>> conditions_;
  std::vector<Read> reads_;
  std::vector<Expr> keep_alive_;
};

class Composer {
 public:
  Composer(IslContext& context, const FuncPtr& source) : context_(context), source_(source) {}

  isl::map of(const FuncPtr& output) {
    for (const FuncPtr& f : topological_order({output})) relations_.emplace(f.get(), relations(*f));
    isl::map result = empty_map(context_.ctx, output->args.size(), dims());
    for (const isl::map& of_value : relations_.at(output.get())) result = result.unite(of_value);
    return tidy(result);
  }

 private:
  size_t dims() const { return source_->args.size(); }

  // The relation of the value that is read, if the values of its Tuple have separate relations.
  isl::map relation_of(const Call& call) const {
    auto found = relations_.find(call.symbol.raw());
    if (found == relations_.end()) return empty_map(context_.ctx, call.args.size(), dims());
    const std::vector<isl::map>& values = found->second;
    return values.size() == 1 ? values[0] : values[static_cast<size_t>(call.component)];
  }
  bool depends(const Symbol* f) const {
    auto found = relations_.find(f);
    return found != relations_.end() &&
           std::ranges::any_of(found->second, [](const isl::map& m) { return !m.is_empty(); });
  }

  // One relation for each value of a Tuple, or one for all if updates may couple them.
  std::vector<isl::map> relations(const FuncContents& f) const {
    if (&f == source_.get()) {
      return {isl::manage(
          isl_map_identity(isl_space_alloc(context_.ctx, 0, size_of(dims()), size_of(dims()))))};
    }
    if (f.is_extern()) refuse_dependent(f);
    std::vector<FuncPtr> callees = direct_callees(f);
    if (std::ranges::none_of(callees, [&](const FuncPtr& callee) { return depends(callee.get()); }))
      return {empty_map(context_.ctx, f.args.size(), dims())};
    if (f.is_pure() && f.types.size() > 1) {
      return numbered(f.types.size(), [&](size_t k) { return tidy(of_stage(f, 0, k)); });
    }
    isl::map result = empty_map(context_.ctx, f.args.size(), dims());
    for (int s = 0; s < f.stage_count(); ++s) result = result.unite(of_stage(f, s, std::nullopt));
    if (!result.is_empty()) result = coupling(f).apply_range(result);
    return {tidy(result)};
  }

  void refuse_dependent(const FuncContents& f) const {
    for (const ExternArgument& a : f.extern_definition->args) {
      if (!a.func || !depends(a.func.get())) continue;
      unsupported(text("find the pattern of derivatives through ", quoted(f.name)),
                  "which element depends on which is read off definitions",
                  text("the C function ", quoted(f.extern_definition->function), " computes it"),
                  "Write it with Funcs, or evaluate products with single directions");
    }
  }

  isl::map of_stage(const FuncContents& f, int s, std::optional<size_t> value) const {
    StageRelations stage(context_, f, s);
    isl::map result = empty_map(context_.ctx, f.args.size(), dims());
    std::vector<Read> reads = stage.reads(value);
    std::erase_if(reads, [&](const Read& r) { return !depends(r.call->symbol.raw()); });
    if (reads.empty()) return result;
    isl::map written = stage.written_by();
    for (const Read& r : reads) {
      isl::map read = stage.access(r.call->args, r.where);
      result = result.unite(written.apply_range(read).apply_range(relation_of(*r.call)));
      result = tidy(result);
    }
    return result;
  }

  // {element -> element of f that it may have been computed from}: equal in the dimensions in which every update reads
  // and writes at its own pure variable.
  isl::map coupling(const FuncContents& f) const {
    isl::map result = universe_map(context_.ctx, f.args.size(), f.args.size());
    bool couples = false;
    for (const Definition& update : f.updates) couples |= reads_elsewhere(f, update);
    for (size_t d = 0; d < f.args.size(); ++d) {
      if (couples && !keeps(f, d)) continue;
      int at = static_cast<int>(d);
      result = isl::manage(isl_map_equate(result.release(), isl_dim_in, at, isl_dim_out, at));
    }
    return result;
  }
  static bool reads_elsewhere(const FuncContents& f, const Definition& update) {
    bool result = false;
    for_each_self_read(f, update, [&](const Call& call) {
      for (size_t d = 0; d < f.args.size(); ++d) result |= !equal(call.args[d], update.args[d]);
    });
    for (const Expr& arg : update.args) result |= calls(arg, &f);
    result |= calls(update.predicate, &f);
    return result;
  }
  static bool keeps(const FuncContents& f, size_t d) {
    bool result = true;
    for (const Definition& update : f.updates) {
      result &= is_pure_position(f, update, d);
      for_each_self_read(f, update, [&](const Call& call) {
        const auto* v = call.args[d].as<Variable>();
        result &= v && !v->symbol.defined() && v->name == f.args[d];
      });
    }
    return result;
  }
  static void for_each_self_read(const FuncContents& f, const Definition& update,
                                 FunctionRef<void(const Call&)> visit) {
    for_each_expr(update, [&](const Expr& root) {
      walk(without_lets(root), [&](const Call& call) {
        if (is_call_of(call, &f)) visit(call);
      });
    });
  }

  IslContext& context_;
  const FuncPtr& source_;
  std::unordered_map<const Symbol*, std::vector<isl::map>> relations_;
};

isl::set box_set(isl_ctx* ctx, const Box& box, size_t dims) {
  isl_set* s = isl_set_universe(isl_space_set_alloc(ctx, 0, size_of(dims)));
  for (size_t d = 0; d < box.size() && d < dims; ++d) {
    auto min = box[d].min.defined() ? as_const_int(simplify(box[d].min)) : std::nullopt;
    auto max = box[d].max.defined() ? as_const_int(simplify(box[d].max)) : std::nullopt;
    if (min) s = isl_set_lower_bound_si(s, isl_dim_set, size_of(d), static_cast<int>(*min));
    if (max) s = isl_set_upper_bound_si(s, isl_dim_set, size_of(d), static_cast<int>(*max));
  }
  return isl::manage(s);
}

}  // namespace

Dependence::Dependence(const FuncPtr& f, const FuncPtr& source, unsigned long operations)
    : context_(operations), map_(Composer(context_, source).of(f)) {}

isl::map Dependence::inside(const Box& of_f, const Box& of_source) const {
  auto dims = [&](isl_dim_type type) { return static_cast<size_t>(isl_map_dim(map_.get(), type)); };
  return coalesced(map_.intersect_domain(box_set(context_.ctx, of_f, dims(isl_dim_in)))
                       .intersect_range(box_set(context_.ctx, of_source, dims(isl_dim_out))));
}

}  // namespace retrograde::autodiff
