// generator_output.cpp -- creates the Funcs of outputs and checks that generate() defines them as declared.
#include "generator/generator_output.h"

#include "generator/generator_base.h"

namespace retrograde::internal {

GeneratorOutputBase::GeneratorOutputBase(Declared declared, IOKind kind, Declared fixed,
                                         bool is_array)
    : GeneratorPort(std::move(declared), kind, std::move(fixed), is_array, true) {
  if (GeneratorMembers* members = GeneratorMembers::around(this)) members->outputs.push_back(this);
}

Func GeneratorOutputBase::make_func(size_t i) const {
  Func f;
  declare(f, i);
  return f;
}

void GeneratorOutputBase::declare(const Func& f, size_t i) const {
  graph::FuncContents& contents = *f.function();
  contents.name = graph::claim_name(element_name(i));
  if (!types_defined() || !dims_defined()) return;
  contents.required_types = types();
  contents.required_dimensions = dims();
}

void GeneratorOutputBase::check_assignable(const Func& f) const {
  if (is_array() || f.defined()) return;
  refuse("assign " + quoted(f.name()) + " to", "the Func has a definition", "it has none",
         "Define it first");
}

void GeneratorOutputBase::check_defined() {
  const std::vector<Func> all = funcs();
  agree_on_size(all.size());
  for (size_t i = 0; i < all.size(); i++) {
    if (!all[i].defined()) {
      refuse("generate", "generate() defines every output",
             quoted(element_name(i)) + " has no definition",
             "Define it: " + element_name(i) + "(x, y) = ...");
    }
    agree_on(all[i].types(), all[i].dimensions());
  }
}

}  // namespace retrograde::internal
