// abstract_generator.h -- what a program must be able to do to be compiled like a generator.
// Generator<T> is one implementation; a front end with other ways to declare inputs and outputs
// derives from AbstractGenerator itself and registers a function that makes one:
//
//   static RegisterGenerator registered("blur", [](const GeneratorContext& context) {
//     return AbstractGeneratorPtr(new BlurFromAFile(context));
//   });
//
// One object makes one pipeline: its params are set, its inputs may be bound, build_pipeline() is
// called once, and then its parameters and Funcs can be asked for.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "frontend/data/parameter.h"
#include "frontend/run/module.h"
#include "generator/generator_context.h"
#include "generator/generator_io.h"

namespace retrograde::internal {

using ArgInfoKind = IOKind;
enum class ArgInfoDirection { Input, Output };

class AbstractGenerator {
 public:
  struct ArgInfo {
    std::string name;
    ArgInfoDirection dir = ArgInfoDirection::Input;
    ArgInfoKind kind = ArgInfoKind::Scalar;
    std::vector<Type> types;  // several for a Tuple; none while they are open
    int dimensions = 0;       // -1 while they are open
  };

  virtual ~AbstractGenerator() = default;
  virtual std::string name() = 0;  // that it is registered under
  virtual GeneratorContext context() const = 0;
  // In the order of the compiled function's arguments. Names differ.
  virtual std::vector<ArgInfo> arginfos() = 0;
  virtual bool allow_out_of_order_inputs_and_outputs() const = 0;
  // Before build_pipeline().
  virtual void set_generatorparam_value(const std::string& name, const std::string& value) = 0;
  virtual void set_generatorparam_value(const std::string& name, const LoopLevel& value) = 0;
  // Instead of a parameter of the compiled function. Before build_pipeline().
  virtual void bind_input(const std::string& name, const std::vector<Parameter>& values) = 0;
  virtual void bind_input(const std::string& name, const std::vector<Func>& values) = 0;
  virtual void bind_input(const std::string& name, const std::vector<Expr>& values) = 0;
  virtual Pipeline build_pipeline() = 0;
  // After build_pipeline(). Arrays have several.
  virtual std::vector<Parameter> input_parameter(const std::string& name) = 0;
  virtual std::vector<Func> output_func(const std::string& name) = 0;
  // Writes the file, or does nothing and gives false where there is no such form of it.
  virtual bool emit_cpp_stub(const std::string& path) = 0;
  virtual bool emit_hlpipe(const std::string& path) = 0;

  // As GeneratorBase's of these names.
  void set_generatorparam_values(const std::map<std::string, std::string>& values);
  Module build_module(const std::string& function_name = "");
  Module build_gradient_module(const std::string& function_name);
  Callable compile_to_callable(const JITHandlers* handlers = nullptr,
                               const std::map<std::string, JITExtern>* externs = nullptr);
};

using AbstractGeneratorPtr = std::unique_ptr<AbstractGenerator>;

class GeneratorBase;

// As a GeneratorBase: itself, or one whose inputs and outputs are those that it describes.
// Requires: a generator is defined.
std::unique_ptr<GeneratorBase> as_generator_base(AbstractGeneratorPtr generator);

}  // namespace retrograde::internal
