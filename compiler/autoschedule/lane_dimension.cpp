#include "autoschedule/lane_dimension.h"

#include <algorithm>
#include <optional>

#include "autoschedule/stored_reads.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"

namespace retrograde::autoschedule {

namespace {

class LaneVotes {
 public:
  explicit LaneVotes(size_t dimensions) : votes_(dimensions) {}

  // Of reads whose next lane is the next value of the variable.
  void add(const std::vector<Expr>& calls, const std::string& lane) {
    for (const Expr& e : calls) {
      const auto& args = e.as<Call>()->args;
      for (size_t d = 0; d < args.size(); ++d) votes_[d] += uses_variable(args[d], lane) ? 1 : 0;
    }
  }
  // The first of them keeps its place where it has any.
  bool are_for(size_t d) const { return votes_[0] == 0 && votes_[d] > 0; }

 private:
  std::vector<int> votes_;
};

}  // namespace

LaneDimensions::LaneDimensions(const std::vector<FuncPtr>& outputs,
                               const std::vector<FuncPtr>& stored, int lanes,
                               const SizeEstimate& sizes) {
  const auto may_turn = [&](const FuncPtr& f) {
    const bool is_output = std::find(outputs.begin(), outputs.end(), f) != outputs.end();
    return f->is_pure() && !f->is_extern() && !f->made && !is_output && f->args.size() > 1 &&
           !has_directives(*f) && 2 * sizes.extent(*f, 0).value_or(lanes) <= lanes;
  };
  std::optional<StoredReads> reads;
  for (auto f = stored.rbegin(); f != stored.rend(); ++f) {  // readers first
    if (!may_turn(*f)) continue;
    if (!reads) reads.emplace(outputs, stored);
    LaneVotes votes((*f)->args.size());
    for (const StoredRead& read : reads->of(*f)) {
      const size_t along = of(*read.reader);
      if (along < read.reader->args.size() &&
          is_pure_position(*read.reader, read.reader->stage(read.stage), along))
        votes.add(read.calls, read.reader->args[along]);
    }
    for (size_t d = 1; d < (*f)->args.size(); ++d) {
      const bool is_long = sizes.extent(**f, d).value_or(0) >= lanes;
      if (is_long && votes.are_for(d) && !reads->is_hidden(*f)) others_.emplace(f->get(), d);
    }
  }
}

size_t LaneDimensions::of(const FuncContents& f) const {
  const auto found = others_.find(&f);
  return found == others_.end() ? 0 : found->second;
}

}  // namespace retrograde::autoschedule
