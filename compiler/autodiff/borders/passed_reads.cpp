#include "autodiff/borders/passed_reads.h"

#include <algorithm>
#include <set>

#include "autodiff/updates/update_context.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// A read at a corner of a two-dimensional box has this many pieces.
constexpr size_t most_pieces = 4;

// Whether each index is a function of one variable, a different one each. Diagonals and slices do not qualify: most
// elements of their Func are never read.
bool maps_coordinates(const Call& call, const std::vector<std::string>& args) {
  std::set<std::string> used;
  for (const Expr& index : call.args) {
    const auto uses = [&](const std::string& arg) { return uses_variable(index, arg); };
    const auto found = std::find_if(args.begin(), args.end(), uses);
    if (depends_on_data(index) || std::count_if(args.begin(), args.end(), uses) != 1 ||
        !used.insert(*found).second)
      return false;
  }
  return used.size() == args.size();
}

bool is_look_up(const Expr& value, const std::vector<std::string>& args) {
  if (const auto* choice = value.as<Select>()) {
    if (depends_on_data(choice->condition)) return false;
    return is_const(choice->when_true)
               ? is_look_up(choice->when_false, args)
               : is_const(choice->when_false) && is_look_up(choice->when_true, args);
  }
  const auto* call = value.as<Call>();
  if (!call) return false;
  if (call->is_marker()) return is_look_up(call->args[0], args);
  return call->call_type != CallType::Operator && call->type.is_float() &&
         maps_coordinates(*call, args);
}

}  // namespace

bool is_look_up(const FuncContents& f) {
  if (!f.is_pure() || f.is_extern() || f.custom_derivatives) return false;
  const auto& values = f.pure->values;
  return std::all_of(values.begin(), values.end(),
                     [&](const Expr& value) { return is_look_up(without_lets(value), f.args); });
}

Expr value_of_read(const FuncContents& f, const Call& read) {
  Substitution place;
  for (size_t d = 0; d < f.args.size(); ++d) place[f.args[d]] = read.args[d];
  return substitute(without_lets(f.pure->values[static_cast<size_t>(read.component)]), place);
}

bool is_short(const Inversion& inversion) {
  return inversion.note.empty() && !inversion.gave_up && inversion.gathers.size() <= most_pieces &&
         std::none_of(inversion.gathers.begin(), inversion.gathers.end(),
                      [](const Gather& g) { return g.rdom || g.scatters; });
}

bool sums_no_more(const Inversion& passed, const LeafAdjoint& leaf, const Inversion& direct) {
  const auto is_sum = [](const Inversion& i) {
    return i.note.empty() && !i.gave_up && i.gathers.size() == 1 && i.gathers[0].rdom &&
           !i.gathers[0].scatters && i.gathers[0].is_everywhere();
  };
  const auto* call = leaf.leaf.as<Call>();
  const auto has_quotient = [](const Expr& index) {
    return any_node(index, [](const Expr& e) { return e.kind() == Kind::Div; });
  };
  const bool divides = call && std::ranges::any_of(call->args, has_quotient);
  if (!divides || !is_sum(passed) || !is_sum(direct)) return false;
  const auto &a = passed.gathers[0].rdom->vars, &b = direct.gathers[0].rdom->vars;
  return std::ranges::equal(a, b, [](const ReductionVariable& r, const ReductionVariable& s) {
    return can_prove(r.extent <= s.extent);
  });
}

const std::vector<PassedRead>& PassedReads::of(const Symbol* symbol) const {
  static const std::vector<PassedRead> none;
  const auto found = reads_.find(symbol);
  return found == reads_.end() || closed_.contains(symbol) ? none : found->second;
}

}  // namespace retrograde::autodiff
