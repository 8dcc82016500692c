// generator_io.cpp -- completes the declarations of inputs and outputs, and checks that all sources agree.
#include "generator/generator_io.h"

#include "generator/generator_base.h"
#include "ir/print.h"

namespace retrograde::internal {

namespace {

std::string list_of(const std::vector<Type>& types) {
  return listed(types, [](const Type& type) { return to_string(type); });
}

}  // namespace

GeneratorPort::GeneratorPort(Declared declared, IOKind kind, Declared fixed, bool is_array,
                             bool is_output)
    : name_(std::move(declared.name)),
      kind_(kind),
      types_(std::move(fixed.types)),
      dims_(fixed.dims),
      is_array_(is_array),
      array_size_(fixed.size),
      is_output_(is_output) {
  if (const GeneratorMembers* members = GeneratorMembers::around(this))
    generator_ = members->owner();
  try {
    if (!declared.types.empty() || declared.dims != any_size) {
      agree_on(declared.types, declared.dims);
    }
    if (declared.size != any_size) agree_on_size(static_cast<size_t>(declared.size));
  } catch (const CompileError& error) {
    contradiction_ = error.message();
  }
}

void GeneratorPort::check_declaration() const {
  if (!contradiction_.asked.empty()) throw CompileError(contradiction_);
}

void GeneratorPort::refuse(const std::string& asked, const std::string& rule,
                           const std::string& evidence, const std::string& instead) const {
  std::string whose = generator_ ? " of the generator " + quoted(generator_->name()) : "";
  user_error(asked + " the " + role_name() + " " + quoted(name_) + whose, rule, evidence, instead);
}

const std::vector<Type>& GeneratorPort::types() const {
  if (!types_defined()) {
    refuse("take the type of", "it is known once it is declared, set or given",
           "it is still unknown", "Call set_type() in configure(), or give " + name_ + ".type=");
  }
  return types_;
}

Type GeneratorPort::type() const {
  if (types().size() != 1) {
    refuse("take the type of", "it has one value", text("it has ", types_.size()), "Use types()");
  }
  return types_[0];
}

int GeneratorPort::dims() const {
  if (!dims_defined()) {
    refuse("take the dimensions of", "they are known once they are declared, set or given",
           "nothing has said them yet",
           "Call set_dimensions() in configure(), or give " + name_ + ".dim=");
  }
  return dims_;
}

size_t GeneratorPort::array_size() const {
  if (!array_size_defined()) {
    refuse("take the array size of", "it is known once it is declared, set or given",
           "it is still unknown",
           "Call set_array_size() in configure(), resize() an output, or give " + name_ + ".size=");
  }
  return static_cast<size_t>(array_size_);
}

void GeneratorPort::set_types(const std::vector<Type>& types) {
  check_not_generated("set the type of");
  agree_on(types, any_size);
}

void GeneratorPort::set_dimensions(int dims) {
  check_not_generated("set the dimensions of");
  agree_on({}, dims);
}

void GeneratorPort::set_array_size(int size) {
  check_not_generated("set the array size of");
  agree_on_size(static_cast<size_t>(size));
}

std::string GeneratorPort::element_name(size_t i) const {
  return is_array_ ? name_ + "_" + std::to_string(i) : name_;
}

void GeneratorPort::agree_on(const std::vector<Type>& types, int dims) {
  if (!types.empty() && !types_.empty() && types != types_) {
    refuse("use " + list_of(types) + " as the type of", "its type is declared once",
           "it is declared as " + list_of(types_), "Leave one of them open, or convert the value");
  }
  if (dims != any_size && dims_ != any_size && dims != dims_) {
    refuse(text("use ", dims, " as the dimensions of"), "its dimensions are declared once",
           text("it is declared with ", dims_), "Leave one of them open, or give another value");
  }
  if (!types.empty()) types_ = types;
  if (dims != any_size) dims_ = dims;
}

void GeneratorPort::agree_on_size(size_t size) {
  const int requested = static_cast<int>(size);
  if (requested < 0 || (array_size_defined() && requested != array_size_)) {
    refuse(text("use ", requested, " as the array size of"),
           "its size is set once, and not negative",
           array_size_defined() ? text("it is ", array_size_) : "it is open",
           "Give that many elements");
  }
  array_size_ = requested;
}

void GeneratorPort::check_not_generated(const char* asked) const {
  if (!generator_ || !generator_->is_generated()) return;
  refuse(asked, "configure() is the place for that", "generate() has run", "Do it in configure()");
}

void GeneratorPort::check_index(size_t i) const {
  if (i < array_size()) return;
  refuse(text("take element ", i, " of"), "elements are counted from 0 to below the array's size",
         text("its size is ", array_size()), "Take an element that it has, or give another size");
}

}  // namespace retrograde::internal
