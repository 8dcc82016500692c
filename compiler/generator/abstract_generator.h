// abstract_generator.h -- the interface of generators. Generator<T> is one implementation. A front end that declares
// inputs and outputs in another way derives from AbstractGenerator and registers a function that creates an object:
//
//   static RegisterGenerator registered("blur", [](const GeneratorContext& context) {
//     return AbstractGeneratorPtr(new BlurFromAFile(context));
//   });
//
// An object builds one pipeline. First its parameters are set and its inputs may be bound, then build_pipeline() is
// called once, and after that the parameters of its inputs and the Funcs of its outputs are available.
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

// Scalar, Func or buffer.
using ArgInfoKind = IOKind;
// Whether an argument is read or written.
enum class ArgInfoDirection { Input, Output };

// The interface of everything that can be compiled like a generator.
class AbstractGenerator {
 public:
  // A declared input or output.
  struct ArgInfo {
    std::string name;                                // name of the argument
    ArgInfoDirection dir = ArgInfoDirection::Input;  // input or output
    ArgInfoKind kind = ArgInfoKind::Scalar;          // scalar, Func or buffer
    std::vector<Type> types;                         // several for a Tuple; empty if not yet known
    int dimensions = 0;                              // -1 if not yet known
  };

  virtual ~AbstractGenerator() = default;
  virtual std::string name() = 0;                // name in the registry
  virtual GeneratorContext context() const = 0;  // target and autoscheduler that it is created for
  // The inputs and outputs in the order of the compiled function's arguments. Names are unique.
  virtual std::vector<ArgInfo> arginfos() = 0;
  // Whether outputs may precede inputs.
  virtual bool allow_out_of_order_inputs_and_outputs() const = 0;
  // Sets a generator parameter; must precede build_pipeline().
  virtual void set_generatorparam_value(const std::string& name, const std::string& value) = 0;
  virtual void set_generatorparam_value(const std::string& name, const LoopLevel& value) = 0;
  // Binds an input to a value instead of a parameter of the compiled function; must precede build_pipeline().
  virtual void bind_input(const std::string& name, const std::vector<Parameter>& values) = 0;
  virtual void bind_input(const std::string& name, const std::vector<Func>& values) = 0;
  virtual void bind_input(const std::string& name, const std::vector<Expr>& values) = 0;
  // Defines and schedules the outputs; called once.
  virtual Pipeline build_pipeline() = 0;
  // The parameters of an input, several for an array; after build_pipeline().
  virtual std::vector<Parameter> input_parameter(const std::string& name) = 0;
  // The Funcs of an output, several for an array; after build_pipeline().
  virtual std::vector<Func> output_func(const std::string& name) = 0;
  // Writes the header by which other generators use this one. Returns false if it has none.
  virtual bool emit_cpp_stub(const std::string& path) = 0;
  // Writes the serialized pipeline. Returns false if there is no such form.
  virtual bool emit_hlpipe(const std::string& path) = 0;

  // Sets several generator parameters.
  void set_generatorparam_values(const std::map<std::string, std::string>& values);
  // Builds the module of the pipeline, as GeneratorBase::build_module.
  Module build_module(const std::string& function_name = "");
  // Builds the module of the gradients, as GeneratorBase::build_gradient_module.
  Module build_gradient_module(const std::string& function_name);
  // Compiles the pipeline for this process, as GeneratorBase::compile_to_callable.
  Callable compile_to_callable(const JITHandlers* handlers = nullptr,
                               const std::map<std::string, JITExtern>* externs = nullptr);
};

// An owned generator.
using AbstractGeneratorPtr = std::unique_ptr<AbstractGenerator>;

class GeneratorBase;

// The generator as a GeneratorBase. If it is not one, the result is an adapter with the inputs and outputs
// that the generator describes.
// Requires: a generator is defined.
std::unique_ptr<GeneratorBase> as_generator_base(AbstractGeneratorPtr generator);

}  // namespace retrograde::internal
