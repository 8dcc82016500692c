// Recursion goes from Func to Func, so it is as deep as the pipeline; it runs on a stack of its own
// (diagnostics/large_stack.h).
#include "testing/interpreter.h"

#include <iterator>

#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "testing/interpreter/func_values.h"

namespace retrograde::oracle {

using graph::FuncPtr;

class Interpreter::Impl {
 public:
  explicit Impl(const InterpreterOptions& options) : options_(options) {}

  std::vector<Array> realize(const std::vector<FuncPtr>& funcs,
                             const std::vector<Region>& regions) {
    values_.clear();
    std::vector<Array> result;
    for (size_t i = 0; i < funcs.size(); ++i) {
      if (regions[i].dimensions() != funcs[i]->dimensions()) {
        call_error("interpret " + quoted(funcs[i]->name),
                   "the region has as many dimensions as the Func",
                   text(regions[i].dimensions(), " instead of ", funcs[i]->dimensions()));
      }
      std::ranges::move(values_.realize(*funcs[i], regions[i]), std::back_inserter(result));
    }
    return result;
  }

  const Inputs& inputs() const { return inputs_; }

 private:
  const InterpreterOptions options_;
  Inputs inputs_;
  FuncValues values_{options_, inputs_};
};

Interpreter::Interpreter(InterpreterOptions options) : impl_(std::make_unique<Impl>(options)) {}
Interpreter::~Interpreter() = default;

std::vector<Array> Interpreter::realize(const FuncPtr& func, const Region& region) {
  return realize(std::vector<FuncPtr>{func}, std::vector<Region>{region});
}

std::vector<Array> Interpreter::realize(const std::vector<FuncPtr>& funcs,
                                        const std::vector<Region>& regions) {
  std::vector<Array> result;
  run_on_large_stack([&] { result = impl_->realize(funcs, regions); });
  return result;
}

Region Interpreter::touched(const graph::ParameterContents& image) const {
  return impl_->inputs().touched(image);
}

}  // namespace retrograde::oracle
