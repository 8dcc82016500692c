#include "autoschedule/running_sums.h"

namespace retrograde::autoschedule {

bool is_running_sum(const FuncContents& f, const FuncContents& reader) {
  return f.made && reader.made && f.made->role == reader.made->role && !f.made->of.empty() &&
         f.made->of == reader.made->of && summed_adjoints(f).size() >= least_summed;
}

std::vector<FuncPtr> summed_adjoints(const FuncContents& f) {
  std::vector<FuncPtr> result = direct_callees(f);
  std::erase_if(result, [&](const FuncPtr& callee) {
    return !callee->made || callee->made->role != Role::Adjoint ||
           (f.made && callee->made->of == f.made->of);
  });
  return result;
}

}  // namespace retrograde::autoschedule
