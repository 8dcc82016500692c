// registry.cpp -- the generators that are linked into this program.
#include "generator/registry.h"

#include <mutex>
#include <set>

#include "diagnostics/error.h"
#include "generator/generator_base.h"

namespace retrograde::internal {

namespace {

struct Registered {
  std::mutex mutex;
  std::map<std::string, GeneratorFactory> factories;
  std::map<std::string, std::string> stub_names;
  std::set<std::string> claimed_twice;
};
Registered& registered() {
  static Registered result;
  return result;
}

std::string list_of_names() {
  const std::string list = listed(GeneratorRegistry::enumerate(), quoted);
  return list.empty() ? "none is linked into this program" : "there are " + list;
}

}  // namespace

void GeneratorRegistry::register_factory(const std::string& name, GeneratorFactory factory,
                                         const std::string& stub_name) {
  std::lock_guard lock(registered().mutex);
  registered().stub_names[name] = stub_name;
  if (!registered().factories.emplace(name, std::move(factory)).second)
    registered().claimed_twice.insert(name);
}

void GeneratorRegistry::unregister_factory(const std::string& name) {
  std::lock_guard lock(registered().mutex);
  registered().factories.erase(name);
  registered().claimed_twice.erase(name);
}

std::vector<std::string> GeneratorRegistry::enumerate() {
  std::lock_guard lock(registered().mutex);
  return ir::keys_of(registered().factories);
}

std::unique_ptr<GeneratorBase> GeneratorRegistry::create(const std::string& name,
                                                         const GeneratorContext& context) {
  GeneratorFactory factory;
  std::string stub_name;
  bool twice = false;
  {
    std::lock_guard lock(registered().mutex);
    if (auto found = registered().factories.find(name); found != registered().factories.end())
      factory = found->second;
    stub_name = registered().stub_names[name];
    twice = registered().claimed_twice.count(name) > 0;
  }
  if (!factory) {
    user_error("create the generator " + quoted(name),
               "a generator is created by the name that it is registered under", list_of_names(),
               "Name one of these, or register it with RETROGRADE_REGISTER_GENERATOR");
  }
  if (twice) {
    user_error("create the generator " + quoted(name), "a name is registered once",
               "two generators have it", "Rename one of them");
  }
  std::unique_ptr<GeneratorBase> generator = as_generator_base(factory(context));
  generator->set_stub_name(stub_name);
  return generator;
}

std::unique_ptr<GeneratorBase> create_alias(const std::string& name, const std::string& original,
                                            const GeneratorParamsMap& params,
                                            const GeneratorContext& context) {
  std::unique_ptr<GeneratorBase> generator = GeneratorRegistry::create(original, context);
  generator->set_name(name);
  generator->set_generator_param_values(params);
  return generator;
}

}  // namespace retrograde::internal

namespace retrograde {

Callable create_callable_from_generator(const GeneratorContext& context, const std::string& name,
                                        const std::map<std::string, std::string>& params) {
  const auto generator = internal::GeneratorRegistry::create(name, context);
  generator->set_generator_param_values(internal::GeneratorParamsMap(params.begin(), params.end()));
  return generator->compile_to_callable();
}

Callable create_callable_from_generator(const Target& target, const std::string& name,
                                        const std::map<std::string, std::string>& params) {
  return create_callable_from_generator(GeneratorContext(target), name, params);
}

}  // namespace retrograde
