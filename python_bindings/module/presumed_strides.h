// presumed_strides.h -- compiled code may rely on dense strides of arrays whose first dimensions are short.
//
// A tensor (points, 3) or (height, width, 3) is mostly dense. Code that knows the stride 3 loads and stores several
// points at once as whole vectors; without it, each lane is loaded alone. So a Callable is compiled for dense strides
// where the bounds of the dimensions before are promised constants of at most `most_elements` elements together. The
// first call with other strides compiles it again without them. Promises of the user are kept.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "graph/definitions/parameter_contents.h"
#include "ir/build.h"

namespace retrograde::python {

class PresumedStrides {
 public:
  using Parameter = std::shared_ptr<graph::ParameterContents>;
  static constexpr int64_t most_elements = 16;

  // `parameters`: arguments and outputs in the order of calls; null for scalars.
  explicit PresumedStrides(std::vector<Parameter> parameters)
      : parameters_(std::move(parameters)), dropped_(parameters_.size()) {}

  // Whether the last compilation presumed nothing else of the array. If not, the next one presumes nothing.
  template <class AnyBuffer>
  bool fit(size_t i, const AnyBuffer& buffer) {
    for (const Stride& one : strides_) {
      if (one.array != i || buffer.dim(static_cast<int>(one.dimension)).stride() == one.elements)
        continue;
      dropped_[i] = true;
      return false;
    }
    return true;
  }

  // Compiles while the strides are promises. Requires: the caller does not hold Python's lock.
  template <class Compile>
  auto compile(const Compile& run) {
    const std::lock_guard alone(compiling());
    strides_ = find();
    const Promises promises(parameters_, strides_);
    return run();
  }

 private:
  struct Stride {
    size_t array, dimension;
    int64_t elements;
  };

  // Parameters are shared by the Callables of a program, so the promises end with the compilation.
  class Promises {
   public:
    Promises(const std::vector<Parameter>& parameters, const std::vector<Stride>& strides)
        : parameters_(parameters), strides_(strides) {
      set(true);
    }
    ~Promises() { set(false); }
    Promises(const Promises&) = delete;
    Promises& operator=(const Promises&) = delete;

   private:
    void set(bool are_promised) const {
      for (const Stride& one : strides_) {
        graph::ParameterContents& parameter = *parameters_[one.array];
        parameter.constraints[one.dimension].stride =
            are_promised ? Expr(static_cast<int>(one.elements)) : Expr();
        parameter.version++;
      }
    }
    const std::vector<Parameter>& parameters_;
    const std::vector<Stride>& strides_;
  };

  static std::mutex& compiling() {
    static std::mutex mutex;
    return mutex;
  }

  std::vector<Stride> find() const {
    std::vector<Stride> result;
    for (size_t i = 0; i < parameters_.size(); ++i) {
      if (!parameters_[i] || dropped_[i]) continue;
      const std::vector<graph::BufferConstraint>& all = parameters_[i]->constraints;
      int64_t elements = 1;
      for (size_t d = 0; d + 1 < all.size(); ++d) {
        const auto extent =
            all[d].extent.defined() ? ir::as_const_int(all[d].extent) : std::nullopt;
        const bool is_known = extent && *extent > 0 && !all[d].any_stride;
        if (!is_known || (elements *= *extent) > most_elements) break;
        if (!all[d + 1].stride.defined()) result.push_back({i, d + 1, elements});
      }
    }
    return result;
  }

  const std::vector<Parameter> parameters_;
  std::vector<bool> dropped_;    // by array
  std::vector<Stride> strides_;  // of the last compilation
};

}  // namespace retrograde::python
