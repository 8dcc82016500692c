// errors.cpp -- translates exceptions of the library to Python exceptions with the four parts of their messages.
//
// The classes are defined in Python (retrograde/_errors.py), so that they can be pickled and inherit from built-in
// exceptions.
#include <map>
#include <regex>
#include <set>

#include "bind_all.h"
#include "binding.h"
#include "diagnostics/error.h"
#include "graph/names.h"

namespace retrograde::python {

namespace {

// Writes names as the user did, "f" for "f$3". A program that is defined again and again, as in a notebook or by a
// function, has such names. Where a message mentions two names that differ in their number alone, both keep it.
class ShortNames {
 public:
  explicit ShortNames(const std::string& message) {
    static const std::regex plain("\"([A-Za-z_]\\w*)\"|([A-Za-z_]\\w*)(?=[.])");
    for (const std::smatch& match : matches(message, numbered()))
      alike_[graph::without_numbers(match.str())].insert(match.str());
    for (const std::smatch& match : matches(message, plain)) {
      const std::string name = match[1].matched ? match[1].str() : match[2].str();
      if (const auto found = alike_.find(name); found != alike_.end()) found->second.insert(name);
    }
  }

  std::string operator()(const std::string& words) const {
    std::string result;
    auto copied = words.cbegin();
    for (const std::smatch& match : matches(words, numbered())) {
      const std::string shorter = graph::without_numbers(match.str());
      const auto found = alike_.find(shorter);
      result.append(copied, match[0].first);
      result += found != alike_.end() && found->second.size() == 1 ? shorter : match.str();
      copied = match[0].second;
    }
    return result.append(copied, words.cend());
  }

 private:
  std::map<std::string, std::set<std::string>> alike_;  // by the name without numbers

  static const std::regex& numbered() {
    static const std::regex name("[A-Za-z_]\\w*(\\$\\d+\\w*)+");
    return name;
  }
  static std::vector<std::smatch> matches(const std::string& words, const std::regex& name) {
    return {std::sregex_iterator(words.begin(), words.end(), name), std::sregex_iterator()};
  }
};

void raise(const char* type, const Error& error, const py::dict& more) {
  const py::object errors = py::module_::import("retrograde._errors");
  const py::object cls = errors.attr(type);
  const Message& message = error.message();
  const ShortNames shown(error.what());
  const auto [words, instead] =
      errors.attr("in_python")(shown(error.what()), shown(message.instead))
          .cast<std::pair<std::string, std::string>>();
  const py::object exception = cls(words);
  exception.attr("asked") = shown(message.asked);
  exception.attr("rule") = shown(message.rule);
  exception.attr("evidence") = shown(message.evidence);
  exception.attr("instead") = instead;
  for (const auto& [name, value] : more) py::setattr(exception, name, value);
  PyErr_SetObject(cls.ptr(), exception.ptr());
}

void translate(std::exception_ptr pending) {
  using namespace py::literals;
  try {
    std::rethrow_exception(pending);
  } catch (const RuntimeError& error) {
    raise("RuntimeError", error, py::dict("code"_a = error.code()));
  } catch (const CompileError& error) {
    raise("CompileError", error, {});
  } catch (const UserError& error) {
    raise("UserError", error, {});
  } catch (const Unsupported& error) {
    raise("Unsupported", error, {});
  } catch (const InternalError& error) {
    raise("InternalError", error,
          py::dict("pass_name"_a = error.pass(), "ir_before"_a = error.ir_before()));
  } catch (const Error& error) {
    raise("Error", error, {});
  }
}

}  // namespace

void bind_errors(py::module_&) { py::register_local_exception_translator(&translate); }

}  // namespace retrograde::python
