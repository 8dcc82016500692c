// several_points.cpp -- turns the points of scatter() into an innermost, unrolled variable of the reduction domain:
//
//   f(scatter(a, b), y) = gather(u, v)
//       =>   RDom k(0, 2);  f(select(k == 0, a, b), y) = select(k == 0, u, v)
//
// All reads of f must come before the stores. An update without an RDom reads a copy of f. An update over an RDom may
// read values that earlier iterations stored; there k is not a loop but numbers the points, and each iteration computes
// all points before it stores the first (graph::ReductionVariable::numbers_points). If no point reads what an earlier
// point of its iteration stores, k is a loop anyway, because such updates have adjoints.
#include "frontend/language/several_points.h"

#include <algorithm>

#include "frontend/language/integer_ops.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/define.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/wrappers.h"
#include "ir/build.h"
#include "ir/memory_reads.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde {

namespace {

constexpr const char *scatter_name = "scatter", *gather_name = "gather";

Expr pack(const char* name, const std::vector<Expr>& points) {
  const std::string asked = std::string("name several points by ") + name + "()";
  if (points.empty())
    user_error(asked, "at least one point is named", "the list is empty", "Give it Exprs");
  for (const Expr& e : points) {
    if (!e.defined())
      user_error(asked, "each point is a defined Expr", "one of them was never assigned",
                 "Assign every Expr before it is used");
    if (e.type() == points[0].type()) continue;
    user_error(asked, "all points are of one type",
               text(to_string(points[0].type()), " and ", to_string(e.type()), " are among them"),
               "Convert them: cast<int>(...)");
  }
  return ir::call_extern(name, points[0].type(), points);
}

}  // namespace

Expr scatter(const std::vector<Expr>& points) { return pack(scatter_name, points); }
Expr gather(const std::vector<Expr>& points) { return pack(gather_name, points); }

namespace frontend {

namespace {

const Call* as_pack(const Expr& e) {
  const auto* call = e.as<Call>();
  const bool is_pack = call && call->call_type == CallType::Extern &&
                       (call->name == scatter_name || call->name == gather_name);
  return is_pack ? call : nullptr;
}

std::vector<const Call*> packs_in(const std::vector<Expr>& exprs) {
  std::vector<const Call*> result;
  for (const Expr& root : exprs) {
    if (!root.defined()) continue;
    walk(root, [&](const Expr& e) {
      if (const Call* call = as_pack(e)) result.push_back(call);
      return true;
    });
  }
  return result;
}

class SeveralPoints {
 public:
  SeveralPoints(const FuncPtr& f, const std::vector<Expr>& args, const std::vector<Expr>& values)
      : f_(f),
        asked_("update " + quoted(f->name) + " at several points"),
        args_(args),
        values_(values) {}

  void define() {
    find_domain();
    check_points();
    if (!f_->is_defined())
      user_error(asked_, "a first definition is for all points", "it has no definition",
                 "Define it first, as in f(x) = 0");
    const bool reads = reads_itself(args_) || reads_itself(values_) || reads_itself(conditions());
    if (reads && !old_) read_a_copy();
    make_domain(reads && old_ && !may_take_turns());
    const std::vector<Expr> args = at_point(args_), values = at_point(values_);
    define_update(f_, args, values, domain_);
    if (point_number(f_->updates.back())) return;
    Stage(f_, f_->stage_count() - 1).unroll(VarOrRVar(number_, true));
  }

 private:
  void check_points() {
    const std::vector<const Call*> places = packs_in(args_);
    std::vector<const Call*> all = places;
    for (const std::vector<Expr>& exprs : {values_, conditions()}) {
      const std::vector<const Call*> read = packs_in(exprs);
      all.insert(all.end(), read.begin(), read.end());
    }
    const bool is_named =
        std::ranges::all_of(places, [](const Call* call) { return call->name == scatter_name; });
    if (!is_named)
      user_error(asked_, "scatter() names the places on the left-hand side",
                 "gather() is on the left-hand side", "Write f(scatter(a, b)) = gather(u, v)");
    for (const Call* call : all) {
      const int points = static_cast<int>(call->args.size());
      if (points_ == 0) points_ = points;
      if (points == points_) continue;
      user_error(asked_, "all scatter() and gather() of an update have the same number of points",
                 text("one has ", points_, " and one has ", points), "Give as many to each");
    }
  }

  void find_domain() {
    std::vector<Expr> all = args_;
    all.insert(all.end(), values_.begin(), values_.end());
    for (const Expr& e : all) {
      walk(e, [&](const Variable& v) {
        if (!old_) old_ = domain_of(v);
      });
    }
  }
  std::vector<Expr> conditions() const {
    return old_ && old_->predicate.defined() ? std::vector<Expr>{old_->predicate}
                                             : std::vector<Expr>();
  }

  // Adds k to the user's domain. `at_once`: k numbers points and is not a loop.
  void make_domain(bool at_once) {
    const graph::ReductionVariable number{number_, Expr(0), Expr(points_), at_once};
    domain_ = std::make_shared<ReductionDomainContents>();
    if (old_) {
      old_->frozen = true;
      domain_->vars = old_->vars;
    }
    domain_->vars.insert(at_once ? domain_->vars.end() : domain_->vars.begin(), number);
    for (const Expr& condition : at_point(conditions()))  // lest the domain own itself
      domain_->predicate = rebind_symbol(condition, SymbolRef::weak(domain_));
  }
  Expr rebound(const Expr& e) const {
    return old_ ? rebind_symbol(e, old_.get(), SymbolRef(domain_)) : e;
  }

  bool reads_itself(const std::vector<Expr>& exprs) const {
    return std::ranges::any_of(exprs, [&](const Expr& e) { return calls(e, f_.get()); });
  }

  void read_a_copy() {
    const FuncPtr before = clone_of(f_, f_->name + "_before");
    before->schedule.compute_level.kind = graph::LoopLevel::Kind::Root;
    before->schedule.store_level = before->schedule.compute_level;
    for (std::vector<Expr>* exprs : {&args_, &values_}) {
      for (Expr& e : *exprs) e = redirect_calls(e, f_, before, false);
    }
  }

  // ---- can each point be stored as soon as it is computed? ----

  bool may_take_turns() const {
    std::vector<std::vector<Expr>> stored;  // coordinates of the earlier points
    for (int i = 0; i < points_; ++i) {
      std::vector<Expr> place = of_point(args_, i), all = of_point(values_, i);
      all.insert(all.end(), place.begin(), place.end());
      for (const Expr& condition : of_point(conditions(), i)) all.push_back(condition);
      for (const std::vector<Expr>& earlier : stored) {
        if (may_read(all, earlier)) return false;
      }
      stored.push_back(std::move(place));
    }
    return true;
  }
  bool may_read(const std::vector<Expr>& exprs, const std::vector<Expr>& place) const {
    return std::ranges::any_of(exprs, [&](const Expr& root) {
      return any_node(root, [&](const Call& call) {
        return is_call_of(call, f_.get()) && !are_apart(call.args, place);
      });
    });
  }
  static bool are_apart(const std::vector<Expr>& a, const std::vector<Expr>& b) {
    for (size_t d = 0; d < a.size() && d < b.size(); ++d) {
      if (simplification::can_prove(cast<int>(a[d]) != cast<int>(b[d]))) return true;
    }
    return false;
  }
  static std::vector<Expr> of_point(const std::vector<Expr>& exprs, int i) {
    return mapped(exprs, [&](const Expr& e) { return element(e, i); });
  }

  std::vector<Expr> at_point(const std::vector<Expr>& exprs) const {
    return mapped(exprs, [&](const Expr& e) { return rebound(chosen(e)); });
  }
  // e at the point k; e itself if it contains no scatter() or gather().
  Expr chosen(const Expr& e) const {
    if (packs_in({e}).empty()) return e;
    const Expr point = variable(number_, Int(32), SymbolRef(domain_));
    Expr result = element(e, points_ - 1);
    for (int i = points_ - 2; i >= 0; --i) result = make_select(point == i, element(e, i), result);
    return result;
  }
  static Expr element(const Expr& e, int i) {
    return rewrite(e, [&](const Expr& part, const auto& recurse) {
      const Call* call = as_pack(part);
      return call ? recurse(call->args[static_cast<size_t>(i)]) : Expr();
    });
  }

  const FuncPtr f_;
  const std::string asked_, number_ = unique_name("points") + ".k";
  std::vector<Expr> args_, values_;
  int points_ = 0;
  std::shared_ptr<ReductionDomainContents> old_, domain_;
};

}  // namespace

bool names_several_points(const std::vector<Expr>& exprs) { return !packs_in(exprs).empty(); }

void define_several_points(const FuncPtr& f, const std::vector<Expr>& args,
                           const std::vector<Expr>& values) {
  SeveralPoints(f, args, values).define();
}

}  // namespace frontend
}  // namespace retrograde
