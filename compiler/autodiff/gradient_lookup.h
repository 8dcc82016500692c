// gradient_lookup.h -- looks up gradients that were not built: returns a zero with its reason, or throws.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "autodiff/report/explain.h"
#include "graph/function.h"

namespace retrograde {

// Gradients by inputs that the output does not depend on. Each is built when it is first requested; later requests
// return the same Func.
class ZeroGradients {
 public:
  // `facts` are the explanations of the synthesis. Throws CompileError if they show that the gradient exists but was
  // not built.
  graph::FuncPtr find(const std::shared_ptr<const ir::Symbol>& symbol, const std::string& name,
                      const std::vector<Explanation>& facts);
  std::vector<Explanation> explanations() const;

 private:
  mutable std::mutex mutex_;
  // The keys keep the symbols alive, so that no other symbol gets the same address.
  std::map<std::shared_ptr<const ir::Symbol>, graph::FuncPtr> zeros_;
  std::vector<Explanation> explanations_;
};

namespace autodiff {

// The image that a Func reads point by point, without any computation: f(x, y) = im(x, y); else null.
std::shared_ptr<const ParameterContents> image_read_by(const FuncContents& f);

}  // namespace autodiff
}  // namespace retrograde
