// Parallel loops: the body becomes a separate function (outline.cpp), which the runtime calls for each iteration.
//
//   parallel x in [min, min + extent): body
//      =>
//   code = retrograde_parallel_for(context, task, min, extent, &closure)
//   if (code) fail(code)
#include "codegen/function_generator.h"

namespace retrograde::codegen {

using namespace ir;

void FunctionGenerator::parallel_loop(const For& s) {
  Value *min, *extent;
  {
    const MemoScope scope(c_.frame, false);
    min = b_.CreateIntCast(values_.of(s.min), b_.getInt32Ty(), true);
    extent = b_.CreateIntCast(values_.of(s.extent), b_.getInt32Ty(), true);
  }
  const Task task = outline(s.body, "parallel", s.name, s.name, s.min.type());
  Value* code = c_.call_runtime("retrograde_parallel_for", b_.getInt32Ty(),
                                {task.function, min, extent, task.closure});
  c_.fail_unless(b_.CreateICmpEQ(code, b_.getInt32(0)), [&] { return code; });
}

}  // namespace retrograde::codegen
