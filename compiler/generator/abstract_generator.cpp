// abstract_generator.cpp -- an adapter that presents the generators of other front ends as GeneratorBases.
#include "generator/abstract_generator.h"

#include "diagnostics/error.h"
#include "generator/generator_base.h"

namespace retrograde::internal {

namespace {

// An input that the generator describes. Once it has parameters, their number tells whether it is an array.
class DescribedInput : public GeneratorInputBase {
 public:
  explicit DescribedInput(const AbstractGenerator::ArgInfo& info)
      : GeneratorInputBase(declared_by(info), info.kind, Declared(""), false) {}
  static Declared declared_by(const AbstractGenerator::ArgInfo& info) {
    Declared declared(info.name, info.types);
    declared.dims = info.kind == IOKind::Scalar ? 0 : info.dimensions;
    return declared;
  }
  // Does nothing: the generator creates its own parameters.
  void make_parameters() override {}
  void take(const std::vector<Parameter>& parameters) {
    if (parameters.size() != 1) become_array();
    set_values(ir::mapped(
        parameters, [&](const Parameter& parameter) { return value_of(parameter.contents()); }));
  }

 protected:
  void values_changed() override {}
};

class DescribedOutput : public GeneratorOutputBase {
 public:
  explicit DescribedOutput(const AbstractGenerator::ArgInfo& info)
      : GeneratorOutputBase(DescribedInput::declared_by(info), info.kind, Declared(""), false) {}
  std::vector<Func> funcs() const override { return funcs_; }
  void make_funcs() override {}
  void take(const std::vector<Func>& funcs) {
    if (funcs.size() != 1) become_array();
    funcs_ = funcs;
  }

 private:
  std::vector<Func> funcs_;
};

class DescribedGenerator : public GeneratorBase {
 public:
  // Owns the generator unless `owned` is null.
  DescribedGenerator(AbstractGenerator& generator, AbstractGeneratorPtr owned)
      : GeneratorBase(sizeof(DescribedGenerator)), generator_(generator), owned_(std::move(owned)) {
    init_from_context(generator_.context());
    set_name(generator_.name());
  }
  bool allow_out_of_order_inputs_and_outputs() const override {
    return generator_.allow_out_of_order_inputs_and_outputs();
  }
  bool emit_cpp_stub(const std::string& path) override { return generator_.emit_cpp_stub(path); }
  bool emit_hlpipe(const std::string& path) override { return generator_.emit_hlpipe(path); }

 protected:
  bool set_declared_part(const std::string& key, const StringOrLoopLevel& value) override {
    if (value.level.defined())
      generator_.set_generatorparam_value(key, value.level);
    else
      generator_.set_generatorparam_value(key, value.text);
    return true;
  }
  void call_configure() override {
    for (const AbstractGenerator::ArgInfo& info : generator_.arginfos()) {
      if (info.dir == ArgInfoDirection::Input) {
        inputs_.push_back(new DescribedInput(info));
        add_port(inputs_.back());
      } else {
        outputs_.push_back(new DescribedOutput(info));
        add_port(outputs_.back());
      }
    }
  }
  void call_generate() override {
    for (DescribedInput* input : inputs_) {
      if (!input->values().empty()) bind(*input);
    }
    Pipeline pipeline = generator_.build_pipeline();
    for (DescribedInput* input : inputs_) {
      if (input->values().empty()) input->take(generator_.input_parameter(input->name()));
    }
    for (DescribedOutput* output : outputs_) output->take(generator_.output_func(output->name()));
    use_pipeline(std::move(pipeline));
  }
  void call_schedule() override {}

 private:
  AbstractGenerator& generator_;
  const AbstractGeneratorPtr owned_;
  std::vector<DescribedInput*> inputs_;  // held as ports of the base class
  std::vector<DescribedOutput*> outputs_;

  void bind(const DescribedInput& input) {
    const std::vector<InputValue>& values = input.values();
    const bool are_parameters = std::ranges::all_of(
        values, [](const InputValue& value) { return value.parameter != nullptr; });
    if (are_parameters && input.kind() != IOKind::Function) {
      generator_.bind_input(input.name(), ir::mapped(values, [](const InputValue& value) {
                              return Parameter(value.parameter);
                            }));
    } else if (input.kind() == IOKind::Function) {
      generator_.bind_input(input.name(),
                            ir::mapped(values, [](const InputValue& value) { return value.func; }));
    } else {
      generator_.bind_input(input.name(),
                            ir::mapped(values, [](const InputValue& value) { return value.expr; }));
    }
  }
};

// Calls `use` with the generator as a GeneratorBase, without taking ownership.
template <typename Use>
auto with_base(AbstractGenerator& generator, const Use& use) {
  if (auto* base = dynamic_cast<GeneratorBase*>(&generator)) return use(*base);
  DescribedGenerator described(generator, nullptr);
  return use(described);
}

}  // namespace

std::unique_ptr<GeneratorBase> as_generator_base(AbstractGeneratorPtr generator) {
  if (!generator) {
    user_error("use a generator", "a generator is defined", "the function that makes it gave none",
               "Let it give a generator, or throw an error");
  }
  if (auto* base = dynamic_cast<GeneratorBase*>(generator.get())) {
    generator.release();
    return std::unique_ptr<GeneratorBase>(base);
  }
  AbstractGenerator& held = *generator;
  return std::make_unique<DescribedGenerator>(held, std::move(generator));
}

void AbstractGenerator::set_generatorparam_values(
    const std::map<std::string, std::string>& values) {
  for (const auto& [name, value] : values) set_generatorparam_value(name, value);
}

Module AbstractGenerator::build_module(const std::string& function_name) {
  return with_base(*this, [&](GeneratorBase& base) { return base.build_module(function_name); });
}

Module AbstractGenerator::build_gradient_module(const std::string& function_name) {
  return with_base(*this,
                   [&](GeneratorBase& base) { return base.build_gradient_module(function_name); });
}

Callable AbstractGenerator::compile_to_callable(const JITHandlers* handlers,
                                                const std::map<std::string, JITExtern>* externs) {
  return with_base(
      *this, [&](GeneratorBase& base) { return base.compile_to_callable(handlers, externs); });
}

}  // namespace retrograde::internal
