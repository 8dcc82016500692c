// generator_context.h -- the environment of a generator (target, autoscheduler, machine), and the names that generators
// use without qualification.
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

// The environment that a generator is created for: target, autoscheduler and machine.
class GeneratorContext {
 public:
  GeneratorContext() = default;  // the default target, no autoscheduler
  explicit GeneratorContext(const Target& target, bool auto_schedule = false,
                            const MachineParams& machine = MachineParams::generic())
      : target_(target), auto_schedule_(auto_schedule), machine_(machine) {}
  // A context with an autoscheduler and its parameters; an empty name means none.
  GeneratorContext(const Target& target, const AutoschedulerParams& params)
      : target_(target), autoscheduler_(params) {}
  const Target& get_target() const { return target_; }  // the target
  // Whether the default autoscheduler runs.
  bool get_auto_schedule() const { return auto_schedule_; }
  // The machine for the autoscheduler.
  const MachineParams& get_machine_params() const { return machine_; }
  // The autoscheduler by name, if one was selected.
  const AutoschedulerParams& autoscheduler_params() const { return autoscheduler_; }

  // Creates a generator for this context: auto blur = context.create<Blur>(); blur->radius.set(3);
  // blur->apply(image); then use blur->out.
  template <typename T>
  std::unique_ptr<T> create() const {
    return T::create(*this);
  }
  // Creates a generator and applies it to inputs.
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

// Names that generators may use without qualification or a using directive.
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
