// param_values.cpp -- sets what a build file or the user leaves to choose: GeneratorParams, and the
// types, dimensions and sizes of inputs and outputs that a generator does not declare.
#include <algorithm>
#include <cctype>
#include <set>

#include "generator/generator_base.h"
#include "generator/registry.h"

namespace retrograde::internal {

namespace {

bool is_valid_name(const std::string& name) {
  if (name.empty() || !std::isalpha(static_cast<unsigned char>(name[0]))) return false;
  return std::ranges::all_of(name, [](unsigned char c) { return std::isalnum(c) || c == '_'; });
}

std::vector<std::string> split_at_commas(const std::string& text) {
  std::vector<std::string> words(1);
  for (char c : text) {
    if (c == ',')
      words.emplace_back();
    else
      words.back() += c;
  }
  return words;
}

}  // namespace

void AutoScheduleParam::set_from_string(const std::string& text) {
  check_writable();
  const std::optional<bool> on = read_bool(text);
  if (on && !*on) {
    scheduler_.clear();
    return;
  }
  const std::string scheduler = on ? default_autoscheduler_name() : text;
  find_autoscheduler(scheduler);
  scheduler_ = scheduler;
}

void GeneratorBase::init_from_context(const GeneratorContext& context) {
  target.set(context.get_target());
  if (context.get_auto_schedule()) auto_schedule.set(true);
  machine_params.set(context.get_machine_params());
  autoscheduler_ = context.autoscheduler_params();
}

GeneratorContext GeneratorBase::context() const {
  if (!autoscheduler_.name.empty()) return GeneratorContext(get_target(), autoscheduler_);
  return GeneratorContext(get_target(), get_auto_schedule(), get_machine_params());
}

void GeneratorBase::set_generator_param_values(const GeneratorParamsMap& values) {
  check_names();
  for (const auto& [key, value] : values) {
    const auto param = std::find_if(members_.params.begin(), members_.params.end(),
                                    [&](const GeneratorParamBase* p) { return p->name() == key; });
    if (param == members_.params.end()) {
      if (key == "autoscheduler")
        autoscheduler_.name = value.text;
      else if (key.starts_with("autoscheduler."))
        autoscheduler_.extra[key.substr(key.find('.') + 1)] = value.text;
      else if (!set_declared_part(key, value))
        unknown_param(key);
    } else if (value.level.defined()) {
      (*param)->set_from_loop_level(value.level);
    } else {
      (*param)->set_from_string(value.text);
    }
  }
}

GeneratorPort* GeneratorBase::find_io(const std::string& name) const {
  for (GeneratorPort* input : members_.inputs) {
    if (input->name() == name) return input;
  }
  for (GeneratorPort* output : members_.outputs) {
    if (output->name() == name) return output;
  }
  return nullptr;
}

// in.type=float32, in.dim=2, in.size=3
bool GeneratorBase::set_declared_part(const std::string& key, const StringOrLoopLevel& value) {
  const std::string& text = value.text;
  const size_t dot = key.find('.');
  if (dot == std::string::npos) return false;
  GeneratorPort* io = find_io(key.substr(0, dot));
  const std::string part = key.substr(dot + 1);
  if (!io || (part != "type" && part != "dim" && part != "size")) return false;
  if (part == "type") {
    std::vector<Type> types;
    for (const std::string& word : split_at_commas(text)) {
      const std::optional<Type> type = read_type(word);
      if (!type) {
        user_error("set " + key + " of the generator " + quoted(name_) + " to " + quoted(text),
                   "types are " + type_choices(), quoted(word) + " is not one of them",
                   "Give one of these, or several with commas for a Tuple");
      }
      types.push_back(*type);
    }
    io->set_types(types);
    return true;
  }
  const std::optional<int> number = read_number<int>(text);
  if (!number || *number < 0) {
    user_error("set " + key + " of the generator " + quoted(name_) + " to " + quoted(text),
               "numbers of dimensions and of elements are whole and at least 0",
               quoted(text) + " was given", "Give such a number");
  }
  if (part == "dim")
    io->set_dimensions(*number);
  else
    io->set_array_size(*number);
  return true;
}

void GeneratorBase::unknown_param(const std::string& key) const {
  std::set<std::string> known;
  for (const GeneratorParamBase* param : members_.params) known.insert(param->name());
  const auto add_open_parts = [&](const GeneratorPort* io) {
    if (!io->types_defined()) known.insert(io->name() + ".type");
    if (!io->dims_defined()) known.insert(io->name() + ".dim");
    if (!io->array_size_defined()) known.insert(io->name() + ".size");
  };
  for (const GeneratorPort* input : members_.inputs) add_open_parts(input);
  for (const GeneratorPort* output : members_.outputs) add_open_parts(output);
  const std::string list = listed(known, quoted);
  user_error("set the GeneratorParam " + quoted(key) + " of the generator " + quoted(name_),
             "only what the generator declares can be set", "it declares " + list,
             "Name one of these");
}

void GeneratorBase::check_names() const {
  std::set<std::string> seen;
  const auto check = [&](const std::string& name, const std::string& what) {
    const std::string asked = "use the generator " + quoted(name_);
    if (!is_valid_name(name)) {
      user_error(asked, "names are letters, digits and underscores, a letter first",
                 "it has the " + what + " " + quoted(name), "Rename it");
    }
    if (!seen.insert(name).second) {
      user_error(asked, "its params, inputs and outputs have different names",
                 "two are called " + quoted(name), "Rename one of them");
    }
  };
  for (const GeneratorParamBase* param : members_.params) check(param->name(), "param");
  for (const GeneratorPort* input : members_.inputs) check(input->name(), "input");
  for (const GeneratorPort* output : members_.outputs) check(output->name(), "output");
  for (const GeneratorPort* input : members_.inputs) input->check_declaration();
  for (const GeneratorPort* output : members_.outputs) output->check_declaration();
}

}  // namespace retrograde::internal
