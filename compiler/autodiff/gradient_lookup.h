// gradient_lookup -- what was asked for by a name that has no gradient of its own: a zero that says
// why, or an error.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "autodiff/report/explain.h"
#include "graph/function.h"

namespace retrograde {

// Gradients of what the output does not depend on, made when somebody asks for them: the same Func
// each time.
class ZeroGradients {
 public:
  // `facts`: what synthesis said.  CompileError when they say that there is a gradient which was
  // not built.
  graph::FuncPtr find(const std::shared_ptr<const ir::Symbol>& symbol, const std::string& name,
                      const std::vector<Explanation>& facts);
  std::vector<Explanation> explanations() const;

 private:
  mutable std::mutex mutex_;
  // Nothing else may hold what was looked up: the next one must not get its address.
  std::map<std::shared_ptr<const ir::Symbol>, graph::FuncPtr> zeros_;
  std::vector<Explanation> explanations_;
};

namespace autodiff {

// The image that a Func reads point by point and does nothing else: f(x, y) = im(x, y); else null.
std::shared_ptr<const ParameterContents> image_read_by(const FuncContents& f);

}  // namespace autodiff
}  // namespace retrograde
