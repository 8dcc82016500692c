// cases.cpp -- see cases.h.
#include "cases.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

namespace programs {

namespace {

const char* const type_names[] = {"int", "uint", "float"};

std::string text_of(const Type& type) { return type_names[type.code] + std::to_string(type.bits); }

Type read_type(const std::string& word) {
  const size_t digits = word.find_first_of("0123456789");
  for (int code = 0; code < 3; code++) {
    if (word.substr(0, digits) == type_names[code]) return {code, std::stoi(word.substr(digits))};
  }
  throw std::runtime_error("no type: " + word);
}

void write_argument(std::ostream& file, const Argument& a) {
  if (a.role == Role::Scalar) {
    file << "value " << text_of(a.type) << " " << a.low << "\n";
    return;
  }
  const bool is_input = a.role == Role::Input;
  file << (is_input ? "in " : "out ") << text_of(a.type)
       << (a.is_interleaved ? " interleaved" : " planar");
  if (is_input) file << (a.is_noise ? " noise " : " picture ") << a.low << " " << a.high;
  for (size_t d = 0; d < a.extents.size(); d++)
    file << " " << (a.mins.empty() ? 0 : a.mins[d]) << ":" << a.extents[d];
  file << "\n";
}

Argument read_argument(const std::string& role, std::istream& words) {
  Argument a;
  std::string type, layout, fill;
  words >> type;
  a.type = read_type(type);
  a.role = role == "in" ? Role::Input : role == "out" ? Role::Output : Role::Scalar;
  if (a.role == Role::Scalar) {
    words >> a.low;
    return a;
  }
  words >> layout;
  a.is_interleaved = layout == "interleaved";
  if (a.role == Role::Input) words >> fill >> a.low >> a.high;
  a.is_noise = fill == "noise";
  char colon = 0;
  for (int min, extent; words >> min >> colon >> extent;) {
    a.mins.push_back(min);
    a.extents.push_back(extent);
  }
  return a;
}

}  // namespace

Argument Argument::interleaved() const {
  Argument a = *this;
  a.is_interleaved = true;
  return a;
}

Argument Argument::noise() const {
  Argument a = *this;
  a.is_noise = true;
  return a;
}

Argument Argument::from(std::vector<int> first) const {
  Argument a = *this;
  a.mins = std::move(first);
  return a;
}

void write_cases(const std::filesystem::path& path, const Program& program) {
  std::ofstream file(path);
  file.precision(17);
  file << "program " << program.name << " " << program.tolerance << "\n";
  file << "gradients " << program.gradients << "\n";
  for (const Case& c : program.cases) {
    file << "case " << c.label << " " << c.threads << "\n";
    for (const Argument& argument : c.arguments) write_argument(file, argument);
  }
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

Program read_cases(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path.string());
  Program program;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string first;
    words >> first;
    if (first == "program") {
      words >> program.name >> program.tolerance;
    } else if (first == "gradients") {
      words >> program.gradients;
    } else if (first == "case") {
      Case& c = program.cases.emplace_back();
      words >> c.label >> c.threads;
    } else if (!program.cases.empty()) {
      program.cases.back().arguments.push_back(read_argument(first, words));
    }
  }
  return program;
}

}  // namespace programs
