// Random pipelines are well formed: whatever a term or an index names is there where it stands.
// The oracle is the description itself: the counts of what is in scope.
#include "testing/random_pipeline.h"

#include <gtest/gtest.h>

namespace retrograde::fuzz {
namespace {

class Scopes {
 public:
  explicit Scopes(const PipelineSpec& pipeline) : pipeline_(pipeline) {}

  void check() {
    for (const FuncSpec& func : pipeline_.funcs) {
      for (const Term& value : func.values) check(value, func.dimensions);
      for (const UpdateSpec& update : func.updates) {
        const int variables = func.dimensions + static_cast<int>(update.domain.size());
        for (const Index& index : update.left) check(index, variables);
        for (const Term& value : update.values) check(value, variables);
        for (const Term& condition : update.predicate) check(condition, variables);
      }
      ++funcs_;
    }
  }

 private:
  void check(const Index& index, int variables) {
    EXPECT_GE(index.variable, -1);
    EXPECT_LT(index.variable, variables);
    for (const Term& data : index.data) check(data, variables);
  }

  void check(const Term& term, int variables) {
    if (term.action == Action::Variable) expect_below(term.source, variables);
    if (term.action == Action::Func) expect_below(term.source, funcs_);
    if (term.action == Action::Image) expect_below(term.source, size(pipeline_.images));
    if (term.action == Action::Parameter) expect_below(term.source, size(pipeline_.parameters));
    for (const Index& index : term.indices) check(index, variables);
    for (const Term& operand : term.operands) check(operand, variables + size(term.domain));
  }

  static void expect_below(int place, int count) {
    EXPECT_GE(place, 0);
    EXPECT_LT(place, count);
  }

  template <typename T>
  static int size(const std::vector<T>& items) {
    return static_cast<int>(items.size());
  }

  const PipelineSpec& pipeline_;
  int funcs_ = 0;  // that may be read: those before
};

void expect_scopes(uint64_t seed) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  Scopes(random_pipeline(seed)).check();
}

TEST(RandomPipeline, NamesWhatIsInScope) {
  for (uint64_t seed = 0; seed < 500; ++seed) expect_scopes(seed);
}

// Where all uses of its variables fold away, an update has no domain, so no term may name them.
TEST(RandomPipeline, UpdatesWithoutADomainDoNotNameIt) {
  for (uint64_t seed = 500082; seed <= 500106; ++seed) expect_scopes(seed);
  expect_scopes(600804);
}

}  // namespace
}  // namespace retrograde::fuzz
