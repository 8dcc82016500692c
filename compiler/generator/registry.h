// registry.h -- generators by name, for the program that build files call.
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
using GeneratorFactory = std::function<AbstractGeneratorPtr(const GeneratorContext& context)>;

class GeneratorRegistry {
 public:
  // Runs before main(), so it never throws: that two generators claim a name is told by create().
  static void register_factory(const std::string& name, GeneratorFactory factory,
                               const std::string& stub_name = "");
  static void unregister_factory(const std::string& name);
  static std::vector<std::string> enumerate();
  // By its name; the error where there is none lists those that are there.
  // Requires: a generator is created by the name that it is registered under; a name is registered
  // once.
  static std::unique_ptr<GeneratorBase> create(const std::string& name,
                                               const GeneratorContext& context);
};

struct RegisterGenerator {
  RegisterGenerator(const std::string& name, GeneratorFactory factory, const char* stub_name = "") {
    GeneratorRegistry::register_factory(name, std::move(factory), stub_name);
  }
};

// The generator `original` with other values of its params.
std::unique_ptr<GeneratorBase> create_alias(const std::string& name, const std::string& original,
                                            const std::map<std::string, StringOrLoopLevel>& params,
                                            const GeneratorContext& context);

}  // namespace retrograde::internal

namespace retrograde {

// A function of this process that a registered generator makes, with these values of its params: it
// takes the inputs, then the outputs. CompileError when there is no generator of the name.
Callable create_callable_from_generator(const GeneratorContext& context, const std::string& name,
                                        const std::map<std::string, std::string>& params = {});
Callable create_callable_from_generator(const Target& target, const std::string& name,
                                        const std::map<std::string, std::string>& params = {});

}  // namespace retrograde

// At global scope. A class whose name has commas stands in parentheses: (Fir<float, 5>). A third
// argument is the name of the stub class: ns::Blur.
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
// RETROGRADE_REGISTER_GENERATOR_ALIAS(blur_3, blur, {{"radius", "3"}})
#define RETROGRADE_REGISTER_GENERATOR_ALIAS(alias, original, ...)                             \
  namespace retrograde_register_generator {                                                   \
  static const ::retrograde::internal::RegisterGenerator register_##alias(                    \
      #alias, [](const ::retrograde::GeneratorContext& context) {                             \
        return ::retrograde::internal::create_alias(#alias, #original, __VA_ARGS__, context); \
      });                                                                                     \
  }
