// binding.h -- helpers for all files of the extension module: bindings of classes and functions whose docstrings come
// from the headers' comments, and the conversions of casters.h.
//
// One file binds one header or topic, so that files compile in parallel in little memory. bind_all.h lists them.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <initializer_list>
#include <string>
#include <utility>

#include "casters.h"

namespace retrograde::python {

namespace py = pybind11;

// The header comment of a name such as "Func::compute_root", from the table that tools/make_docs.py writes. The first
// of the scopes that has the name wins; "" if none has.
const char* documentation(std::initializer_list<const char*> scopes, const std::string& name);
inline const char* documentation(const std::string& name) { return documentation({""}, name); }

// A class whose methods get the documentation of the C++ class of the same name, or of one of `inherited`.
template <class T, class... Options>
class Class : public py::class_<T, Options...> {
  using Base = py::class_<T, Options...>;

 public:
  template <class... Extra>
  Class(py::handle scope, const char* name, std::initializer_list<const char*> inherited,
        const Extra&... extra)
      : Base(scope, name, documentation(name), extra...), scopes_{name} {
    scopes_.insert(scopes_.end(), inherited.begin(), inherited.end());
  }
  Class(py::handle scope, const char* name) : Class(scope, name, {}) {}
  // A class that another file has bound, to add methods to.
  struct Made {
    py::object cls;
  };
  Class(const Made& made, const char* name, std::initializer_list<const char*> inherited)
      : Base(py::reinterpret_borrow<Base>(made.cls)), scopes_{name} {
    scopes_.insert(scopes_.end(), inherited.begin(), inherited.end());
  }

  template <class F, class... Extra>
  Class& def(const char* name, F&& f, const Extra&... extra) {
    Base::def(name, std::forward<F>(f), doc(name), extra...);
    return *this;
  }
  // Constructors, and other definitions that pybind11 builds from one object.
  template <class... Args, class... Extra>
  Class& def(const py::detail::initimpl::constructor<Args...>& init, const Extra&... extra) {
    Base::def(init, doc(scopes_[0]), extra...);
    return *this;
  }
  template <class... Args, class... Extra>
  Class& def(py::detail::initimpl::factory<Args...>&& init, const Extra&... extra) {
    Base::def(std::move(init), doc(scopes_[0]), extra...);
    return *this;
  }
  template <class F, class... Extra>
  Class& def_static(const char* name, F&& f, const Extra&... extra) {
    Base::def_static(name, std::forward<F>(f), doc(name), extra...);
    return *this;
  }
  template <class F>
  Class& def_readwrite(const char* name, F field) {
    Base::def_readwrite(name, field, doc(name));
    return *this;
  }
  template <class F>
  Class& def_readonly(const char* name, F field) {
    Base::def_readonly(name, field, doc(name));
    return *this;
  }
  template <class Get, class Set>
  Class& def_property(const char* name, Get&& get, Set&& set) {
    Base::def_property(name, std::forward<Get>(get), std::forward<Set>(set), doc(name));
    return *this;
  }
  template <class F>
  Class& def_property_readonly(const char* name, F&& get) {
    Base::def_property_readonly(name, std::forward<F>(get), doc(name));
    return *this;
  }

 private:
  const char* doc(const std::string& name) const {
    for (const char* scope : scopes_) {
      if (const char* text = documentation({scope}, name); *text) return text;
    }
    return "";
  }
  std::vector<const char*> scopes_;
};

// A function of the module with the documentation of the C++ function of the same name.
template <class F, class... Extra>
void def(py::module_& module, const char* name, F&& f, const Extra&... extra) {
  module.def(name, std::forward<F>(f), documentation(name), extra...);
}

}  // namespace retrograde::python
