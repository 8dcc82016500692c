// registry.h -- generators by name, for the program that build files call.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "generator/generator_context.h"

namespace retrograde::Internal {

class GeneratorBase;
struct StringOrLoopLevel;
using GeneratorFactory =
    std::function<std::unique_ptr<GeneratorBase>(const GeneratorContext& context)>;

class GeneratorRegistry {
 public:
  // Runs before main(), so it never throws: that two generators claim a name is told by create().
  static void register_factory(const std::string& name, GeneratorFactory factory,
                               const std::string& stub_name = "");
  static void unregister_factory(const std::string& name);
  static std::vector<std::string> enumerate();
  // CompileError when there is none of that name; it lists those that are there.
  static std::unique_ptr<GeneratorBase> create(const std::string& name,
                                               const GeneratorContext& context);
};

struct RegisterGenerator {
  RegisterGenerator(const char* name, GeneratorFactory factory, const char* stub_name = "") {
    GeneratorRegistry::register_factory(name, std::move(factory), stub_name);
  }
};

// The generator `original` with other values of its params.
std::unique_ptr<GeneratorBase> create_alias(const std::string& name, const std::string& original,
                                            const std::map<std::string, StringOrLoopLevel>& params,
                                            const GeneratorContext& context);

}  // namespace retrograde::Internal

// At global scope. A third argument is the name of the stub class: ns::Blur.
#define RETROGRADE_REGISTER_GENERATOR(Class, name, ...)                   \
  namespace retrograde_register_generator {                               \
  static const ::retrograde::Internal::RegisterGenerator register_##name( \
      #name,                                                              \
      [](const ::retrograde::GeneratorContext& context)                   \
          -> std::unique_ptr<::retrograde::Internal::GeneratorBase> {     \
        return Class::create(context, #name);                             \
      },                                                                  \
      #__VA_ARGS__);                                                      \
  }
// RETROGRADE_REGISTER_GENERATOR_ALIAS(blur_3, blur, {{"radius", "3"}})
#define RETROGRADE_REGISTER_GENERATOR_ALIAS(alias, original, ...)                             \
  namespace retrograde_register_generator {                                                   \
  static const ::retrograde::Internal::RegisterGenerator register_##alias(                    \
      #alias, [](const ::retrograde::GeneratorContext& context) {                             \
        return ::retrograde::Internal::create_alias(#alias, #original, __VA_ARGS__, context); \
      });                                                                                     \
  }
