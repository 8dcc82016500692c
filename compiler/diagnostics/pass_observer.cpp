#include "diagnostics/pass_observer.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <vector>

namespace retrograde {

namespace {

// The log that RETROGRADE_PASS_LOG enables.
class PassLog {
 public:
  PassLog() {
    if (const char* file = std::getenv("RETROGRADE_PASS_LOG")) file_ = file;
    if (const char* passes = std::getenv("RETROGRADE_DUMP_AFTER"))
      dumped_ = "," + std::string(passes) + ",";
  }
  bool is_on() const { return !file_.empty(); }

  void write(const PassReport& report) const {
    std::string text = "pass " + report.pass + " " + std::to_string(report.seconds * 1e3) +
                       " ms of " + report.pipeline + "\n";
    if (report.text && dumps(report.pass))
      text += "after " + report.pass + " of " + report.pipeline + ":\n" + report.text() + "\n";
    std::ofstream(file_, std::ios::app) << text;
  }

 private:
  std::string file_, dumped_;
  bool dumps(const std::string& pass) const {
    return dumped_ == ",all," || dumped_.find("," + pass + ",") != std::string::npos;
  }
};

struct Observers {
  std::mutex mutex;
  std::vector<const std::function<void(const PassReport&)>*> list;
  std::atomic<size_t> count{0};
  const PassLog log;
};

Observers& observers() {
  static Observers& instance = *new Observers;
  return instance;
}

}  // namespace

PassObserver::PassObserver(std::function<void(const PassReport&)> observe)
    : observe_(std::move(observe)) {
  const std::lock_guard lock(observers().mutex);
  observers().list.push_back(&observe_);
  observers().count++;
}

PassObserver::~PassObserver() {
  const std::lock_guard lock(observers().mutex);
  auto& list = observers().list;
  list.erase(std::find(list.begin(), list.end(), &observe_));
  observers().count--;
}

void tell_pass_observers(const PassReport& report) {
  Observers& all = observers();
  if (all.count == 0 && !all.log.is_on()) return;
  const std::lock_guard lock(all.mutex);
  if (all.log.is_on()) all.log.write(report);
  for (const auto* observe : all.list) (*observe)(report);
}

}  // namespace retrograde
