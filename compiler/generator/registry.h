// registry.h -- a registry of generators by name, for the programs that build files call.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "generator/abstract_generator.h"
#include "generator/generator_context.h"

namespace retrograde::internal {

class GeneratorBase;
struct StringOrLoopLevel;
// Creates a generator for a context.
using GeneratorFactory = std::function<AbstractGeneratorPtr(const GeneratorContext& context)>;

// The generators of this program by name.
class GeneratorRegistry {
 public:
  // Registers a generator. It runs before main() and never throws; create() reports duplicate names.
  static void register_factory(const std::string& name, GeneratorFactory factory,
                               const std::string& stub_name = "");
  // Removes a name.
  static void unregister_factory(const std::string& name);
  // All registered names.
  static std::vector<std::string> enumerate();
  // Creates the generator of this name. If there is none, the error lists the registered names.
  // Requires: a generator is created by the name that it is registered under; a name is registered
  // once.
  static std::unique_ptr<GeneratorBase> create(const std::string& name,
                                               const GeneratorContext& context);
};

// Registers a generator when it is constructed; RETROGRADE_REGISTER_GENERATOR defines one.
struct RegisterGenerator {
  RegisterGenerator(const std::string& name, GeneratorFactory factory, const char* stub_name = "") {
    GeneratorRegistry::register_factory(name, std::move(factory), stub_name);
  }
};

// Creates the generator `original` with other values of its parameters.
std::unique_ptr<GeneratorBase> create_alias(const std::string& name, const std::string& original,
                                            const std::map<std::string, StringOrLoopLevel>& params,
                                            const GeneratorContext& context);

}  // namespace retrograde::internal

namespace retrograde {

// Compiles a registered generator, with these values of its parameters, to a function in this process. The
// function takes the inputs, then the outputs. Throws CompileError if the name is not registered.
Callable create_callable_from_generator(const GeneratorContext& context, const std::string& name,
                                        const std::map<std::string, std::string>& params = {});
Callable create_callable_from_generator(const Target& target, const std::string& name,
                                        const std::map<std::string, std::string>& params = {});

}  // namespace retrograde

// Registers a generator class under a name; use it at global scope. Put a class name with commas in parentheses:
// (Fir<float, 5>). An optional third argument is the name of the stub class: ns::Blur.
#define RETROGRADE_REGISTER_GENERATOR(Class, name, ...)                   \
  namespace retrograde_register_generator {                               \
  static const ::retrograde::internal::RegisterGenerator register_##name( \
      #name,                                                              \
      [](const ::retrograde::GeneratorContext& context)                   \
          -> ::retrograde::internal::AbstractGeneratorPtr {               \
        using Generated = std::remove_pointer_t<decltype(new Class)>;     \
        return Generated::create(context, #name);                         \
      },                                                                  \
      #__VA_ARGS__);                                                      \
  }
// Registers a generator under another name, with other values of its parameters:
// RETROGRADE_REGISTER_GENERATOR_ALIAS(blur_3, blur, {{"radius", "3"}})
#define RETROGRADE_REGISTER_GENERATOR_ALIAS(alias, original, ...)                             \
  namespace retrograde_register_generator {                                                   \
  static const ::retrograde::internal::RegisterGenerator register_##alias(                    \
      #alias, [](const ::retrograde::GeneratorContext& context) {                             \
        return ::retrograde::internal::create_alias(#alias, #original, __VA_ARGS__, context); \
      });                                                                                     \
  }
