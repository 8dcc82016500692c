// Every program of the suite, each input's gradient element by element against central differences
// in double, which only the interpreter of the algorithm evaluates; then as machine code. A program
// that overwrites what its partials need is refused unless the compiler may keep the values.
#include "gradient/programs_suite.h"

namespace retrograde::gradient {
namespace {

class Suite : public ::testing::TestWithParam<size_t> {
 protected:
  Program program = programs().at(GetParam()).build();
};

TEST_P(Suite, GradientIsRight) {
  AdjointOptions options;
  if (program.store_overwritten) {
    EXPECT_THROW(propagate_adjoints(program.loss), UserError);
    options.overwritten = Overwritten::Store;
  }
  Derivative d = propagate_adjoints(program.loss, options);
  for (size_t i = 0; i < program.inputs.size(); ++i) {
    SCOPED_TRACE("input " + std::to_string(i));
    expect_gradient(program.loss, d, program.inputs[i]);
  }
}

std::string name_of(const ::testing::TestParamInfo<size_t>& info) {
  return programs()[info.param].name;
}

INSTANTIATE_TEST_SUITE_P(Programs, Suite, ::testing::Range<size_t>(0, programs().size()), name_of);

}  // namespace
}  // namespace retrograde::gradient
