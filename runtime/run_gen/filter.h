// filter.h -- calls one compiled function, using its metadata: gives its arguments values and consistent shapes, then
// calls it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "run_gen/inputs.h"

namespace retrograde::run_gen {

struct Filter {
  int (*call)(void** argv) = nullptr;
  const halide_filter_metadata_t* metadata = nullptr;
};

// The functions that registration files have registered.
std::vector<Filter>& registered_filters();
// The function of that name, or the only one. Throws Problem if there is none.
Filter find_filter(const std::string& name);
std::string description(const Filter& filter);

// A call with all its arguments.
class Call {
 public:
  // Throws Problem if a value is missing or unsuitable.
  Call(const Filter& filter, const Options& options);
  // Calls the function and returns its error code. Results on a device stay there.
  int run();
  // Waits for devices.
  int wait();
  // Copies results from devices to the host.
  int bring_results();
  // Writes the outputs for which files were named.
  void write_outputs() const;
  double output_elements() const;  // of the largest output
  std::string shapes() const;      // one line per buffer

 private:
  struct Argument {
    const halide_filter_argument_t* about;
    halide_scalar_value_t scalar = {};
    BufferSpec spec;
    Image image;
    std::string path;        // output file
    bool is_known = false;   // its shape is known
    bool is_wanted = false;  // the user specified the shape
  };
  const Filter filter_;
  const Options& options_;
  std::vector<Argument> arguments_;

  int for_each_result(int (*use)(Image&));
  void set_scalar(Argument& argument);
  void set_input(Argument& argument);
  void set_output(Argument& argument);
  void check_names() const;
  void guess_outputs();
  bool shrink_outputs();
  std::vector<Image> query();
  void settle(const std::vector<Image>& required);
  std::string value_of(const Argument& argument, const std::optional<std::string>& otherwise) const;
  bool is_buffer(const Argument& argument) const {
    return argument.about->kind != halide_argument_kind_input_scalar;
  }
  bool is_output(const Argument& argument) const {
    return argument.about->kind == halide_argument_kind_output_buffer;
  }
};

}  // namespace retrograde::run_gen
