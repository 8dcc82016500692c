// generator_base.h -- the life cycle of a generator. Its parameters are set, configure() may add inputs and outputs,
// generate() defines the outputs, and schedule() schedules them. The result is a Pipeline, a Module, or the Module of
// the gradient.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "frontend/language/lambda.h"
#include "frontend/run/module.h"
#include "generator/abstract_generator.h"
#include "generator/generator_context.h"
#include "generator/generator_input.h"
#include "generator/generator_output.h"
#include "generator/generator_param.h"
#include "generator/members.h"

namespace retrograde {
namespace internal {

// The value of a generator parameter: text or a LoopLevel.
struct StringOrLoopLevel {
  // A value as text.
  StringOrLoopLevel(const std::string& text) : text(text) {}
  StringOrLoopLevel(const char* text) : text(text) {}
  StringOrLoopLevel(std::nullptr_t) = delete;  // and of a literal 0
  // A loop level.
  StringOrLoopLevel(const LoopLevel& level) : level(level) {}
  std::string text;  // the value as text
  LoopLevel level;   // undefined: the value is the text
};
// Values of generator parameters by name.
using GeneratorParamsMap = std::map<std::string, StringOrLoopLevel>;

// The parameter auto_schedule: false, true (the default autoscheduler) or the name of an autoscheduler.
class AutoScheduleParam : public GeneratorParamBase {
 public:
  AutoScheduleParam() : GeneratorParamBase("auto_schedule") {}
  bool value() const { return !scheduler_.empty(); }
  operator bool() const { return value(); }
  const std::string& scheduler() const { return scheduler_; }
  void set(bool on) { set_from_string(on ? "true" : "false"); }
  void set(const std::string& text) { set_from_string(text); }
  void set(const char* text) { set_from_string(text); }
  // Requires: an autoscheduler is loaded from a plugin before it is used.
  void set_from_string(const std::string& text) override;
  std::string to_string() const override { return value() ? scheduler_ : "false"; }
  InCpp in_cpp() const override { return {}; }

 private:
  std::string scheduler_;
};

// The part of Generator<T> that does not depend on T.
class GeneratorBase : public NamesInterface, public AbstractGenerator {
 public:
  ~GeneratorBase() override = default;
  GeneratorBase(const GeneratorBase&) = delete;
  GeneratorBase& operator=(const GeneratorBase&) = delete;

  // Name in the registry, or the name that set_name() gave.
  const std::string& name() const { return name_; }
  std::string name() override { return name_; }
  // Sets the name of the generator, which is also the default name of its function.
  void set_name(const std::string& name) { name_ = name; }
  // Takes over target and autoscheduler from a context.
  void init_from_context(const GeneratorContext& context);
  // A context with the same target and autoscheduler, to create other generators.
  GeneratorContext context() const override;
  Target get_target() const { return target; }  // the target
  // Whether auto_schedule selects an autoscheduler.
  bool get_auto_schedule() const { return auto_schedule; }
  // Whether any autoscheduler will run; then schedule() may skip its directives.
  bool using_autoscheduler() const { return auto_schedule || !autoscheduler_.name.empty(); }
  // The autoscheduler that was selected by name.
  const AutoschedulerParams& get_autoscheduler_params() const { return autoscheduler_; }
  // The machine for the autoscheduler.
  MachineParams get_machine_params() const { return machine_params; }
  // Number of elements of a type in a vector register of the target.
  int natural_vector_size(const Type& type) const { return get_target().natural_vector_size(type); }
  template <typename T>
  int natural_vector_size() const {
    return get_target().natural_vector_size<T>();
  }

  // Sets generator parameters by name, and properties that declarations leave open: in.type=float32,
  // in.dim=2, in.size=3. autoscheduler=NAME selects an autoscheduler and autoscheduler.KEY=VALUE sets its
  // parameters; see AutoschedulerParams.
  // Requires: only what the generator declares can be set; types are names such as float32; numbers
  // of dimensions and of elements are whole and at least 0; a value is set before generate() reads
  // it.
  void set_generator_param_values(const GeneratorParamsMap& values);
  // Writes a header with a class that runs this generator inside another one; see cpp_stub.h.
  bool emit_cpp_stub(const std::string& path) override;
  // Writes a header with a function that applies the schedule of build_module() to a pipeline of the same Funcs:
  //   void apply_schedule_<function>(retrograde::Pipeline pipeline, retrograde::Target target)
  void emit_schedule(const std::string& path, const std::string& function_name = "");
  // Sets the qualified name of the stub class, by default the name of the generator.
  void set_stub_name(const std::string& name) { stub_name_ = name; }

  // Sets the values of all inputs in order; an array takes a std::vector.
  // Requires: all are given, in their order; the value fits the input's type.
  template <typename... Args>
  void set_inputs(const Args&... args) {
    check_input_count(sizeof...(args));
    size_t i = 0;
    (set_input(i++, args), ...);
  }

  // Whether generate() has run.
  bool is_generated() const { return phase_ >= Phase::Generated; }
  // Runs configure() and generate() unless they have run; schedule_all() also runs schedule().
  // Requires: names are letters, digits and underscores, a letter first; its params, inputs and
  // outputs have different names; it declares at least one Output.
  void generate_all();
  void schedule_all();
  // The pipeline of all outputs; after generate().
  // Requires: the Pipeline has the outputs that generate() defines.
  Pipeline get_pipeline();
  // Reports the begin and end of each call to the trace handler; may precede generate().
  void trace_pipeline();
  // The Funcs of one output; after generate().
  // Requires: an output has the name that the generator declares.
  std::vector<Func> output_funcs(const std::string& name) const;
  // Generates, schedules and runs the pipeline; see Pipeline::realize.
  template <typename... Args>
  decltype(auto) realize(Args&&... args) {
    schedule_all();
    return get_pipeline().realize(std::forward<Args>(args)..., get_target());
  }
  Realization realize(std::vector<int32_t> sizes) {
    schedule_all();
    return get_pipeline().realize(sizes, get_target());
  }

  // Builds a module whose function takes the inputs, then the outputs. An empty name means that of the
  // generator.
  // Requires: its inputs are those of the compiled function.
  Module build_module(const std::string& function_name = "",
                      LinkageType linkage = LinkageType::ExternalPlusMetadata);
  // Compiles the pipeline for this process; see Pipeline::compile_to_callable. `handlers` are those of its
  // calls. C functions that it calls by name are in `externs` or symbols of this process.
  Callable compile_to_callable(const JITHandlers* handlers = nullptr,
                               const std::map<std::string, JITExtern>* externs = nullptr);
  // Builds the gradients of every output with respect to every image. The function takes the inputs, then for
  // each output _grad_loss_for_<output>, then for each output and each image _grad_loss_<output>_wrt_<input>.
  // Each has the shape of the image that it belongs to. If the output does not read the input, the name
  // begins with _dummy. schedule() is not called, since it schedules another pipeline; unscheduled Funcs get
  // the default schedule of gradients.
  // Requires: gradients are of outputs with one value; gradients are of floating-point outputs.
  Module build_gradient_module(const std::string& function_name = "");
  // Builds gradients with respect to images and numbers of floating-point types, summed over the outputs, for
  // callers that need only some of them. The main function computes all gradients. If there are several
  // inputs, <function>_by_<input> computes the gradient for one of them. The functions take the inputs, then
  // for each floating-point output _grad_loss_for_<output>, and compute _grad_loss_wrt_<input>. Scheduling is
  // as in build_gradient_module.
  // Requires: gradients are of outputs with one value; gradients are of floating-point outputs;
  // gradients are with respect to floating-point inputs.
  Module build_separate_gradients(const std::string& function_name = "");

  // ---- the interface AbstractGenerator ----

  // The declared inputs and outputs; runs configure().
  std::vector<ArgInfo> arginfos() override;
  // Always false: inputs precede outputs.
  bool allow_out_of_order_inputs_and_outputs() const override { return false; }
  // Sets one generator parameter.
  void set_generatorparam_value(const std::string& name, const std::string& value) override {
    set_generator_param_values({{name, value}});
  }
  void set_generatorparam_value(const std::string& name, const LoopLevel& value) override {
    set_generator_param_values({{name, value}});
  }
  // Binds an input to a value instead of a parameter of the compiled function.
  // Requires: an input has the name that the generator declares.
  void bind_input(const std::string& name, const std::vector<Parameter>& values) override;
  void bind_input(const std::string& name, const std::vector<Func>& values) override;
  void bind_input(const std::string& name, const std::vector<Expr>& values) override;
  // The scheduled pipeline; runs generate() and schedule().
  Pipeline build_pipeline() override;
  // The parameters of an input.
  // Requires: an input has the name that the generator declares.
  std::vector<Parameter> input_parameter(const std::string& name) override;
  // The Funcs of an output.
  std::vector<Func> output_func(const std::string& name) override { return output_funcs(name); }
  // Always returns false: a pipeline has no serialized form.
  bool emit_hlpipe(const std::string&) override { return false; }

  // ---- in configure() ----

  // Adds an input; call it in configure().
  // Requires: inputs and outputs are added in configure().
  template <typename T, typename... Args>
  GeneratorInput<T>* add_input(const std::string& name, const Args&... args) {
    check_configuring("input", name);
    auto* result = new GeneratorInput<T>(name, args...);
    add_port(result);
    return result;
  }
  // Adds an output; call it in configure(). add_output<Func>("pair", {Float(32), UInt(8)}, 2) has several
  // values.
  template <typename T>
  GeneratorOutput<T>* add_output(const std::string& name, const std::vector<Type>& types,
                                 int dims) {
    return add_output<T, std::vector<Type>, int>(name, types, dims);
  }
  template <typename T>
  GeneratorOutput<T>* add_output(const std::string& name, const std::vector<Type>& types) {
    return add_output<T, std::vector<Type>>(name, types);
  }
  template <typename T, typename... Args>
  GeneratorOutput<T>* add_output(const std::string& name, const Args&... args) {
    check_configuring("output", name);
    auto* result = new GeneratorOutput<T>(name, args...);
    add_port(result);
    return result;
  }

  // ---- in generate() ----

  // Makes every call of the compiled function fail with the message unless the condition, over inputs only,
  // holds; call it in generate().
  template <typename... Args>
  void add_requirement(const Expr& condition, Args&&... message) {
    std::vector<Expr> parts;
    (parts.push_back(Expr(std::forward<Args>(message))), ...);
    requirements_.push_back({condition, std::move(parts)});
  }

 protected:
  explicit GeneratorBase(size_t bytes) : members_(this, bytes) {}
  virtual void call_configure() = 0;
  virtual void call_generate() = 0;
  virtual void call_schedule() = 0;
  // Sets something that is not a GeneratorParam; returns false if there is nothing of this name.
  virtual bool set_declared_part(const std::string& key, const StringOrLoopLevel& value);
  // Takes ownership of an input or output that configure() adds.
  void add_port(GeneratorInputBase* input) {
    adopt(input);
    members_.inputs.push_back(input);
  }
  void add_port(GeneratorOutputBase* output) {
    adopt(output);
    members_.outputs.push_back(output);
  }
  // Sets the pipeline, in generate(), instead of the one of the outputs.
  void use_pipeline(Pipeline pipeline);

 private:
  // Declared first, since params, inputs and outputs below and in derived classes register here.
  GeneratorMembers members_;

 protected:
  GeneratorParam<Target> target{"target", Target()};
  AutoScheduleParam auto_schedule;
  GeneratorParam<MachineParams> machine_params{"machine_params", MachineParams::generic()};
  // Options of the built-in autoscheduler as text: autoschedule_options=without=strips+slices,threads=4.
  GeneratorParam<AutoscheduleOptions> autoschedule_options{"autoschedule_options",
                                                           AutoscheduleOptions()};

 private:
  enum class Phase { Created, Configuring, Configured, Generated, Scheduled };
  struct Requirement {
    Expr condition;
    std::vector<Expr> message;
  };

  void configure_once();
  void check_names() const;
  void check_input_count(size_t count);
  void check_configuring(const char* role, const std::string& name) const;
  void adopt(GeneratorPort* extra) {
    extras_.emplace_back(extra);
    extra->generator_ = this;
  }
  void add_requirements(Pipeline& pipeline) const;
  void auto_schedule_pipeline(Pipeline& pipeline) const;
  [[noreturn]] void refuse_value_of(const GeneratorInputBase& input) const;
  std::vector<Argument> input_arguments() const;
  std::vector<std::string> input_names() const;
  using NamedParameter = std::pair<std::string, std::shared_ptr<graph::ParameterContents>>;
  std::vector<NamedParameter> differentiable_inputs() const;
  std::vector<ImageParam> image_inputs(std::vector<std::string>& names) const;
  Module gradient_function(const std::string& function_name, const std::vector<NamedParameter>& by);
  Module to_module(Pipeline& pipeline, const std::vector<Argument>& inputs,
                   const std::vector<std::string>& declared_names, const std::string& function_name,
                   LinkageType linkage);
  [[noreturn]] void unknown_param(const std::string& key) const;
  GeneratorPort* find_io(const std::string& name) const;
  size_t find_input(const std::string& name);

  template <typename A>
  void set_input(size_t i, const A& arg);
  template <typename A>
  void set_input(size_t i, const std::vector<A>& args);
  GeneratorPort* find_input(size_t i) const { return members_.inputs[i]; }
  void set_input_values(size_t i, std::vector<InputValue> values);

  std::string name_ = "generator", stub_name_;
  Phase phase_ = Phase::Created;
  std::vector<std::unique_ptr<GeneratorPort>> extras_;
  std::vector<Requirement> requirements_;
  bool is_traced_ = false;
  AutoschedulerParams autoscheduler_;
  Pipeline pipeline_;
};

// ---- values from C++ ----

// Converts a C++ number to the type of an input, if that is known. Throws CompileError if it does not fit.
Expr constant_for_input(const Expr& value, const GeneratorPort& input);

template <typename A>
InputValue input_value(const GeneratorPort& input, const A& arg) {
  const bool wants_func = input.kind() == IOKind::Function;
  if constexpr (std::is_base_of_v<GeneratorInputBase, A>) {
    const InputValue value = arg.values().at(0);
    if (wants_func && value.kind == IOKind::Buffer)
      return InputValue::of_func(ImageParam(value.parameter));
    return value;
  } else if constexpr (ElementTraits<A>::kind == IOKind::Buffer) {
    return wants_func ? InputValue::of_func(Func(arg)) : InputValue::of_image(arg.parameter());
  } else if constexpr (std::is_base_of_v<ImageParam, A>) {
    return wants_func ? InputValue::of_func(arg) : InputValue::of_image(arg.parameter());
  } else if constexpr (std::is_convertible_v<A, Func>) {
    return InputValue::of_func(arg);
  } else if constexpr (std::is_arithmetic_v<A>) {
    return InputValue::of_expr(constant_for_input(Expr(arg), input));
  } else {
    return InputValue::of_expr(arg);
  }
}

template <typename A>
void GeneratorBase::set_input(size_t i, const A& arg) {
  if constexpr (std::is_base_of_v<GeneratorInputBase, A>) {
    if (arg.is_array()) return set_input_values(i, arg.values());
  }
  set_input_values(i, {input_value(*find_input(i), arg)});
}

template <typename A>
void GeneratorBase::set_input(size_t i, const std::vector<A>& args) {
  auto values = ir::mapped(args, [&](const A& arg) { return input_value(*find_input(i), arg); });
  set_input_values(i, std::move(values));
}

}  // namespace internal
}  // namespace retrograde
