// watching.cpp -- binds warnings, times of compiler passes, and the compile cache on disk.
#include <mutex>

#include "bind_all.h"
#include "binding.h"
#include "callback.h"
#include "diagnostics/pass_observer.h"
#include "frontend/run/compile_cache.h"
#include "frontend/run/warnings.h"

namespace retrograde::python {

namespace {

using py::arg;

// A context manager that collects pass times from the compiler's threads until they are read.
class PassTimes {
 public:
  void enter() {
    observer_ = std::make_unique<PassObserver>([this](const PassReport& report) {
      std::lock_guard lock(mutex_);
      reports_.push_back({report.pipeline, report.pass, report.seconds,
                          wants_text && report.text ? report.text() : ""});
    });
  }
  void leave() {
    const py::gil_scoped_release release;
    observer_.reset();
  }

  struct Row {
    std::string pipeline, pass;
    double seconds;
    std::string text;
  };
  std::vector<Row> reports() const {
    std::lock_guard lock(mutex_);
    return reports_;
  }
  bool wants_text = false;

 private:
  mutable std::mutex mutex_;
  std::vector<Row> reports_;
  std::unique_ptr<PassObserver> observer_;  // destroyed first
};

void bind_passes(py::module_& m) {
  Class<PassTimes::Row>(m, "PassReport")
      .def_readonly("pipeline", &PassTimes::Row::pipeline)
      .def_readonly("pass_", &PassTimes::Row::pass)
      .def_readonly("seconds", &PassTimes::Row::seconds)
      .def_readonly("text", &PassTimes::Row::text)
      .def("__repr__", [](const PassTimes::Row& r) {
        return text("<retrograde.PassReport ", quoted(r.pass), " of ", r.pipeline, ": ",
                    r.seconds * 1e3, " ms>");
      });
  Class<PassTimes>(m, "PassObserver")
      .def(py::init([](bool text) {
             auto times = std::make_unique<PassTimes>();
             times->wants_text = text;
             return times;
           }),
           py::kw_only(), arg("text") = false)
      .def("__enter__",
           [](PassTimes& times) -> PassTimes& {
             times.enter();
             return times;
           })
      .def("__exit__", [](PassTimes& times, const py::args&) { times.leave(); })
      .def_property_readonly("reports", &PassTimes::reports);
}

}  // namespace

void bind_watching(py::module_& m) {
  def(
      m, "warnings_of",
      [](const Pipeline& pipeline) {
        return unlocked([=](const Interruption&) { return warnings_of(pipeline); });
      },
      arg("pipeline"));
  bind_passes(m);
  def(m, "set_compile_cache_directory", &set_compile_cache_directory, arg("folder"),
      arg("max_bytes") = default_compile_cache_bytes);
  m.attr("default_compile_cache_bytes") = default_compile_cache_bytes;
}

}  // namespace retrograde::python
