// generator_context.h -- what a generator is made for: target, scheduler, machine. And the names
// that generators use without qualification.
#pragma once

#include <memory>
#include <utility>

#include "frontend/data/param.h"
#include "frontend/language/expr_ops.h"
#include "frontend/language/func.h"
#include "frontend/schedule/autoscheduler.h"
#include "ir/target.h"

namespace retrograde {

template <typename T>
class GeneratorParam;

class GeneratorContext {
 public:
  GeneratorContext() = default;
  explicit GeneratorContext(const Target& target, bool auto_schedule = false,
                            const MachineParams& machine = MachineParams::generic())
      : target_(target), auto_schedule_(auto_schedule), machine_(machine) {}
  // With a scheduler, which is told this; none where its name is empty.
  GeneratorContext(const Target& target, const AutoschedulerParams& params)
      : target_(target), autoscheduler_(params) {}
  const Target& get_target() const { return target_; }
  bool get_auto_schedule() const { return auto_schedule_; }
  const MachineParams& get_machine_params() const { return machine_; }
  const AutoschedulerParams& autoscheduler_params() const { return autoscheduler_; }

  // auto blur = context.create<Blur>(); blur->radius.set(3); blur->apply(image); use blur->out
  template <typename T>
  std::unique_ptr<T> create() const {
    return T::create(*this);
  }
  template <typename T, typename... Args>
  std::unique_ptr<T> apply(const Args&... args) const {
    std::unique_ptr<T> generator = create<T>();
    generator->apply(args...);
    return generator;
  }

 private:
  Target target_;
  bool auto_schedule_ = false;
  MachineParams machine_;
  AutoschedulerParams autoscheduler_;
};

// What generators call by its plain name, without a using directive.
class NamesInterface {
 protected:
  using EvictionKey = retrograde::EvictionKey;
  using Expr = retrograde::Expr;
  using ExternFuncArgument = retrograde::ExternFuncArgument;
  using Func = retrograde::Func;
  using GeneratorContext = retrograde::GeneratorContext;
  using ImageParam = retrograde::ImageParam;
  using LoopLevel = retrograde::LoopLevel;
  using MemoryType = retrograde::MemoryType;
  using NameMangling = retrograde::NameMangling;
  using Pipeline = retrograde::Pipeline;
  using PrefetchBoundStrategy = retrograde::PrefetchBoundStrategy;
  using RDom = retrograde::RDom;
  using RVar = retrograde::RVar;
  using TailStrategy = retrograde::TailStrategy;
  using Target = retrograde::Target;
  using Tuple = retrograde::Tuple;
  using Type = retrograde::Type;
  using Var = retrograde::Var;
  template <typename T>
  using GeneratorParam = retrograde::GeneratorParam<T>;
  template <typename T = void, int Dims = Runtime::AnyDims>
  using Buffer = retrograde::Buffer<T, Dims>;
  template <typename T>
  using Param = retrograde::Param<T>;
  template <typename T>
  static Expr cast(Expr e) {
    return retrograde::cast<T>(std::move(e));
  }
  static Expr cast(Type type, Expr e) { return retrograde::cast(type, std::move(e)); }
  static Type Bool(int lanes = 1) { return retrograde::Bool(lanes); }
  static Type Float(int bits, int lanes = 1) { return retrograde::Float(bits, lanes); }
  static Type Int(int bits, int lanes = 1) { return retrograde::Int(bits, lanes); }
  static Type UInt(int bits, int lanes = 1) { return retrograde::UInt(bits, lanes); }
};

}  // namespace retrograde
