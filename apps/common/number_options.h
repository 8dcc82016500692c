// number_options.h -- the numeric options of an app, each declared in one place with its range and its help.
//
//   apps::NumberOptions numbers(cli);
//   numbers.add("--shorter", options.shorter_percent, {0, 60}, "percent of the length");
//   if (!apps::parse_command_line(cli, argc, argv, options.common)) return std::nullopt;
//   numbers.check();
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "common/options.h"

namespace apps {

struct NumberRange {
  double low, high;
  bool or_zero = false;  // 0 is also allowed
};

class NumberOptions {
 public:
  explicit NumberOptions(CLI::App& cli) : cli_(cli) {}

  // An option whose default is the current value. `value` must outlive this object.
  template <typename T>
  void add(const std::string& name, T& value, const NumberRange& range, const std::string& help) {
    cli_.add_option(name, value, help)->capture_default_str();
    checks_.emplace_back([name, &value, range] {
      if (!range.or_zero || value != 0)
        require_in_range(name, static_cast<double>(value), range.low, range.high);
    });
  }

  // Throws retrograde::UserError unless all values lie in their ranges.
  void check() const {
    for (const auto& check : checks_) check();
  }

 private:
  CLI::App& cli_;
  std::vector<std::function<void()>> checks_;
};

}  // namespace apps
