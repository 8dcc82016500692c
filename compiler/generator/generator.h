// generator.h -- Generator<T>, the base of pipelines that are classes. A build file compiles them ahead of time, or C++
// code uses them directly.
//
//   class Blur : public Generator<Blur> {
//    public:
//     GeneratorParam<int> radius{"radius", 1, 0, 8};
//     Input<Buffer<float, 2>> in{"in"};
//     Output<Buffer<float, 2>> out{"out"};
//     void generate() { RDom r(-radius, 2 * radius + 1); out(x, y) = sum(in(x + r, y)); }
//     void schedule() { out.vectorize(x, natural_vector_size<float>()); }
//   };
//   RETROGRADE_REGISTER_GENERATOR(Blur, blur)
//
// Linked with generator_main.cpp this is a program: ./blur.generator -g blur -o . target=host radius=2
#pragma once

#include <memory>
#include <string>

#include "generator/generator_base.h"
#include "generator/registry.h"

namespace retrograde {

// Base of a user's generator T, with the members configure(), generate() and schedule().
template <typename T>
class Generator : public internal::GeneratorBase {
 public:
  // Creates a generator for a context, under its registered name or `name`.
  static std::unique_ptr<T> create(const GeneratorContext& context) {
    auto generator = std::make_unique<T>();
    generator->init_from_context(context);
    return generator;
  }
  static std::unique_ptr<T> create(const GeneratorContext& context, const std::string& name) {
    std::unique_ptr<T> generator = create(context);
    generator->set_name(name);
    return generator;
  }
  // Sets all inputs, generates and schedules; then the outputs can be used.
  template <typename... Args>
  void apply(const Args&... args) {
    set_inputs(args...);
    schedule_all();
  }
  // Creates another generator for the same context.
  template <typename T2>
  std::unique_ptr<T2> create() const {
    return context().template create<T2>();
  }
  template <typename T2, typename... Args>
  std::unique_ptr<T2> apply(const Args&... args) const {
    return context().template apply<T2>(args...);
  }

 protected:
  Generator() : GeneratorBase(sizeof(T)) {}
  template <typename T2>
  using Input = GeneratorInput<T2>;
  template <typename T2>
  using Output = GeneratorOutput<T2>;

 private:
  T& self() { return static_cast<T&>(*this); }
  void call_configure() override {
    if constexpr (requires(T & t) { t.configure(); }) self().configure();
  }
  void call_generate() override {
    static_assert(
        requires(T & t) { t.generate(); }, "a generator has a public generate()");
    self().generate();
  }
  void call_schedule() override {
    if constexpr (requires(T & t) { t.schedule(); }) self().schedule();
  }
};

}  // namespace retrograde
