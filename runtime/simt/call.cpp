#include "simt/call.h"

#include <cstdlib>
#include <iterator>
#include <list>
#include <sstream>

namespace retrograde::simt {
namespace {

constexpr const char* names[] = {
#define RETROGRADE_DRIVER(symbol, parameters) #symbol,
#include "gpu/driver_functions.def"
#undef RETROGRADE_DRIVER
};

struct Failure {
  std::string function;  // empty: any
  int64_t calls_left;
  Result result;
};

struct Calls {
  Calls() { read_environment(); }
  void read_environment();
  std::map<std::string, int64_t> counts;
  std::list<Failure> failures;
};

// Format: function:nth:result,function:nth:result
void Calls::read_environment() {
  const char* text = std::getenv("RETROGRADE_SIMT_FAIL");
  std::istringstream entries(text ? text : "");
  for (std::string entry; std::getline(entries, entry, ',');) {
    std::istringstream fields(entry);
    Failure failure = {"", 1, unknown_error};
    std::string nth, result;
    std::getline(fields, failure.function, ':');
    if (std::getline(fields, nth, ':')) failure.calls_left = std::strtoll(nth.c_str(), nullptr, 10);
    if (std::getline(fields, result))
      failure.result = static_cast<Result>(std::strtol(result.c_str(), nullptr, 10));
    failures.push_back(failure);
  }
}

Calls& calls() {
  static Calls& all = *new Calls;
  return all;
}

}  // namespace

Result begin_call(const char* function) {
  calls().counts[function]++;
  Result verdict = success;
  auto& failures = calls().failures;
  for (auto it = failures.begin(); it != failures.end();) {
    const auto here = it++;
    if (!here->function.empty() && here->function != function) continue;
    if (--here->calls_left > 0) continue;
    verdict = here->result;
    failures.erase(here);
  }
  return verdict;
}

int64_t call_count(const char* function) {
  const auto found = calls().counts.find(function);
  return found == calls().counts.end() ? 0 : found->second;
}

const char* function_name(int32_t index) {
  return index >= 0 && index < static_cast<int32_t>(std::size(names)) ? names[index] : nullptr;
}

void add_failure(const char* function, int64_t nth, Result result) {
  calls().failures.push_back({function ? function : "", nth, result});
}

int32_t cancel_failures() {
  const auto count = static_cast<int32_t>(calls().failures.size());
  calls().failures.clear();
  return count;
}

}  // namespace retrograde::simt

using namespace retrograde::simt;

const char* retrograde_simt_function(int32_t index) { return function_name(index); }

int64_t retrograde_simt_call_count(const char* function) {
  const std::lock_guard lock(driver_mutex());
  return call_count(function);
}

void retrograde_simt_fail_call(const char* function, int64_t nth, int32_t result) {
  const std::lock_guard lock(driver_mutex());
  add_failure(function, nth, result);
}

int32_t retrograde_simt_call_off(void) {
  const std::lock_guard lock(driver_mutex());
  return cancel_failures();
}
