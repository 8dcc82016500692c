// generator_base.h -- the life of a generator: its params are set, configure() may add inputs and
// outputs, generate() defines the outputs, schedule() schedules them; then it is a Pipeline, a
// Module, or the Module of its gradient.
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

// A param's value: as text, or a level to be computed at.
struct StringOrLoopLevel {
  StringOrLoopLevel(const std::string& text) : text(text) {}
  StringOrLoopLevel(const char* text) : text(text) {}
  StringOrLoopLevel(std::nullptr_t) = delete;  // and of a literal 0
  StringOrLoopLevel(const LoopLevel& level) : level(level) {}
  std::string text;
  LoopLevel level;  // undefined: the text says it
};
using GeneratorParamsMap = std::map<std::string, StringOrLoopLevel>;

// auto_schedule=false, =true (the default scheduler) or =<name of a scheduler>.
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

class GeneratorBase : public NamesInterface, public AbstractGenerator {
 public:
  ~GeneratorBase() override = default;
  GeneratorBase(const GeneratorBase&) = delete;
  GeneratorBase& operator=(const GeneratorBase&) = delete;

  const std::string& name() const { return name_; }
  std::string name() override { return name_; }
  void set_name(const std::string& name) { name_ = name; }
  void init_from_context(const GeneratorContext& context);
  GeneratorContext context() const override;
  Target get_target() const { return target; }
  bool get_auto_schedule() const { return auto_schedule; }
  bool using_autoscheduler() const { return auto_schedule || !autoscheduler_.name.empty(); }
  const AutoschedulerParams& get_autoscheduler_params() const { return autoscheduler_; }
  MachineParams get_machine_params() const { return machine_params; }
  int natural_vector_size(const Type& type) const { return get_target().natural_vector_size(type); }
  template <typename T>
  int natural_vector_size() const {
    return get_target().natural_vector_size<T>();
  }

  // By name: GeneratorParams, and what declarations leave open: in.type=float32, in.dim=2,
  // in.size=3. autoscheduler=NAME names a scheduler for the pipeline, and autoscheduler.KEY=VALUE tells
  // it something: see AutoschedulerParams.
  // Requires: only what the generator declares can be set; types are names such as float32; numbers
  // of dimensions and of elements are whole and at least 0; a value is set before generate() reads
  // it.
  void set_generator_param_values(const GeneratorParamsMap& values);
  // Writes a header with a class that runs this generator inside another one: see cpp_stub.h.
  bool emit_cpp_stub(const std::string& path) override;
  // Writes a header whose function
  //   void apply_schedule_<function>(retrograde::Pipeline pipeline, retrograde::Target target)
  // gives the schedule that build_module() compiles with to a pipeline of the same Funcs.
  void emit_schedule(const std::string& path, const std::string& function_name = "");
  // Name of that class, with its namespaces; by default that of the generator.
  void set_stub_name(const std::string& name) { stub_name_ = name; }

  // Values for all inputs, in their order; a std::vector for an array.
  // Requires: all are given, in their order; the value fits the input's type.
  template <typename... Args>
  void set_inputs(const Args&... args) {
    check_input_count(sizeof...(args));
    size_t i = 0;
    (set_input(i++, args), ...);
  }

  bool is_generated() const { return phase_ >= Phase::Generated; }
  // Runs what has not run yet of configure(), generate() and schedule().
  // Requires: names are letters, digits and underscores, a letter first; its params, inputs and
  // outputs have different names; it declares at least one Output.
  void generate_all();
  void schedule_all();
  // All outputs together; after generate().
  // Requires: the Pipeline is made of what generate() defines.
  Pipeline get_pipeline();
  // Every call tells when it begins and ends; may be said before generate() has run.
  void trace_pipeline();
  // Of one output. After generate().
  // Requires: an output has the name that the generator declares.
  std::vector<Func> output_funcs(const std::string& name) const;
  template <typename... Args>
  decltype(auto) realize(Args&&... args) {
    schedule_all();
    return get_pipeline().realize(std::forward<Args>(args)..., get_target());
  }
  Realization realize(std::vector<int32_t> sizes) {
    schedule_all();
    return get_pipeline().realize(sizes, get_target());
  }

  // The function takes the inputs, then the outputs. Its name defaults to the generator's.
  // Requires: its inputs are those of the compiled function.
  Module build_module(const std::string& function_name = "",
                      LinkageType linkage = LinkageType::ExternalPlusMetadata);
  // The same in this process: see Pipeline::compile_to_callable.
  // The handlers are those of its calls; the C functions that it calls by name are among `externs`,
  // or in this process.
  Callable compile_to_callable(const JITHandlers* handlers = nullptr,
                               const std::map<std::string, JITExtern>* externs = nullptr);
  // The gradient of every output with respect to every image: the function takes the same inputs,
  // then for each output _grad_loss_for_<output>, then for each output and each image input
  // _grad_loss_<output>_wrt_<input>, all of the shape of what they belong to, with _dummy in front
  // where the output does not read the input. schedule() is not called: it speaks of another
  // pipeline. Funcs that generate() has not scheduled get the default schedule of gradients.
  // Requires: gradients are of outputs with one value; gradients are of floating-point outputs.
  Module build_gradient_module(const std::string& function_name = "");
  // The gradients by images and numbers of floating-point types, summed over the outputs, for who
  // wants some of them: the function gives all; <function>_by_<input>, one for each input where
  // there are several, computes that by this input and nothing else. They take the inputs, then for
  // each floating-point output _grad_loss_for_<output>, and give _grad_loss_wrt_<input>. The rest
  // is as above.
  // Requires: gradients are of outputs with one value; gradients are of floating-point outputs;
  // gradients are by floating-point inputs.
  Module build_separate_gradients(const std::string& function_name = "");

  // ---- by name: see AbstractGenerator ----
  // Runs configure().
  std::vector<ArgInfo> arginfos() override;
  bool allow_out_of_order_inputs_and_outputs() const override { return false; }
  void set_generatorparam_value(const std::string& name, const std::string& value) override {
    set_generator_param_values({{name, value}});
  }
  void set_generatorparam_value(const std::string& name, const LoopLevel& value) override {
    set_generator_param_values({{name, value}});
  }
  // Requires: an input has the name that the generator declares.
  void bind_input(const std::string& name, const std::vector<Parameter>& values) override;
  void bind_input(const std::string& name, const std::vector<Func>& values) override;
  void bind_input(const std::string& name, const std::vector<Expr>& values) override;
  // Runs generate() and schedule().
  Pipeline build_pipeline() override;
  // Requires: an input has the name that the generator declares.
  std::vector<Parameter> input_parameter(const std::string& name) override;
  std::vector<Func> output_func(const std::string& name) override { return output_funcs(name); }
  bool emit_hlpipe(const std::string&) override {
    return false;
  }  // pipelines have no form as bytes

  // ---- in configure() ----
  // Requires: inputs and outputs are added in configure().
  template <typename T, typename... Args>
  GeneratorInput<T>* add_input(const std::string& name, const Args&... args) {
    check_configuring("input", name);
    auto* result = new GeneratorInput<T>(name, args...);
    add_port(result);
    return result;
  }
  // Several types: add_output<Func>("pair", {Float(32), UInt(8)}, 2).
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
  // Every call of the compiled function fails unless the condition, which may use inputs only,
  // holds; the rest is the message.
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
  // Something by this name that is no GeneratorParam; false where there is none.
  virtual bool set_declared_part(const std::string& key, const StringOrLoopLevel& value);
  // In configure(). The generator owns it from now on.
  void add_port(GeneratorInputBase* input) {
    adopt(input);
    members_.inputs.push_back(input);
  }
  void add_port(GeneratorOutputBase* output) {
    adopt(output);
    members_.outputs.push_back(output);
  }
  // In generate(), instead of the one that its outputs would make.
  void use_pipeline(Pipeline pipeline);

 private:
  // First: params, inputs and outputs below and in derived classes register there.
  GeneratorMembers members_;

 protected:
  GeneratorParam<Target> target{"target", Target()};
  AutoScheduleParam auto_schedule;
  GeneratorParam<MachineParams> machine_params{"machine_params", MachineParams::generic()};
  // As text: autoschedule_options=without=strips+slices,threads=4.
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
  void check_input_count(size_t given);
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

// A C++ number for an input of type `type` (undefined: not said yet). CompileError when it does not
// fit.
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
