// Finds the shapes of all buffers. Files and [..] on the command line give shapes. Output shapes are first guessed from
// the largest input, and a bounds query tells which regions the function reads for them. Outputs shrink until no input
// is too small. Buffers without a shape then get the region that is read.
#include "run_gen/filter.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "run_gen/image_files.h"

namespace retrograde::run_gen {

std::vector<Filter>& registered_filters() {
  static std::vector<Filter> filters;
  return filters;
}

Filter find_filter(const std::string& name) {
  std::string names;
  const std::vector<Filter>& all = registered_filters();
  if (name.empty() && all.size() == 1) return all[0];
  for (const Filter& filter : all) {
    if (filter.metadata->name == name) return filter;
    names += std::string(names.empty() ? "" : ", ") + filter.metadata->name;
  }
  if (all.empty()) throw Problem("no function is linked into this program");
  throw Problem(name.empty() ? "--name says which function to run: " + names
                             : "there is no function \"" + name + "\"; there are " + names);
}

std::string description(const Filter& filter) {
  std::string text = "Filter name: \"" + std::string(filter.metadata->name) + "\"\n";
  for (int i = 0; i < filter.metadata->num_arguments; i++) {
    const halide_filter_argument_t& a = filter.metadata->arguments[i];
    const bool is_scalar = a.kind == halide_argument_kind_input_scalar;
    text += std::string("  ") +
            (a.kind == halide_argument_kind_output_buffer ? "Output" : "Input") + " \"" + a.name +
            "\" is of type ";
    text += is_scalar ? type_name(a.type)
                      : "Buffer<" + type_name(a.type) + "> with " + std::to_string(a.dimensions) +
                            " dimensions";
    text += "\n";
  }
  return text;
}

// ---- values ----

Call::Call(const Filter& filter, const Options& options) : filter_(filter), options_(options) {
  for (int i = 0; i < filter.metadata->num_arguments; i++)
    arguments_.push_back({&filter.metadata->arguments[i], {}, {}, {}, "", false, false});
  check_names();
  for (Argument& argument : arguments_) {
    if (!is_buffer(argument))
      set_scalar(argument);
    else if (is_output(argument))
      set_output(argument);
    else
      set_input(argument);
  }
  guess_outputs();
  constexpr int max_rounds = 64;
  for (int round = 0; round < max_rounds && shrink_outputs(); round++) {
  }
  settle(query());
}

void Call::check_names() const {
  for (const auto& [name, value] : options_.values) {
    const bool is_there = std::any_of(arguments_.begin(), arguments_.end(),
                                      [&](const Argument& a) { return a.about->name == name; });
    if (!is_there) throw Problem("there is no argument \"" + name + "\"; see --describe");
  }
}

std::string Call::value_of(const Argument& argument,
                           const std::optional<std::string>& otherwise) const {
  const auto found = options_.values.find(argument.about->name);
  if (found != options_.values.end()) return found->second;
  if (otherwise) return *otherwise;
  throw Problem(std::string("the argument \"") + argument.about->name + "\" has no value");
}

void Call::set_scalar(Argument& argument) {
  const halide_filter_argument_t& about = *argument.about;
  if (about.type.code == halide_type_handle) return;  // null; the user context is such an argument
  const std::string text = value_of(argument, options_.default_scalars);
  for (const std::string& word : split(text, ',')) {
    const halide_scalar_value_t* said = word == "default"    ? about.scalar_def
                                        : word == "estimate" ? about.scalar_estimate
                                                             : nullptr;
    if (said) {
      argument.scalar = *said;
      return;
    }
    if (word == "default" || word == "estimate") continue;
    argument.scalar = read_scalar(about.type, word);
    return;
  }
  throw Problem("the generator sets no " + text + " for \"" + about.name + "\"");
}

// Generated functions use 31-bit element offsets, and HalideBuffer.h multiplies extents in 32 bits.
void check_elements(const std::string& name, const std::vector<int>& extents) {
  int64_t elements = 1;
  for (const int extent : extents) {
    elements *= std::max(1, extent);
    if (elements > INT32_MAX) {
      throw Problem("\"" + name +
                    "\" would have more than 2147483647 elements, which no function " +
                    "takes; give smaller extents");
    }
  }
}

Image generated_image(const halide_filter_argument_t& about, const Shape& shape) {
  if (static_cast<int>(shape.extents.size()) != about.dimensions) {
    throw Problem(std::string("\"") + about.name + "\" has " + std::to_string(about.dimensions) +
                  " dimensions; " + std::to_string(shape.extents.size()) + " extents were given");
  }
  check_elements(about.name, shape.extents);
  Image image(about.type, nullptr, shape.extents);
  for (size_t d = 0; d < shape.mins.size(); d++)
    image.translate(static_cast<int>(d), shape.mins[d]);
  return image;
}

void Call::set_input(Argument& argument) {
  const halide_filter_argument_t& about = *argument.about;
  argument.spec = read_buffer_spec(value_of(argument, options_.default_buffers));
  argument.is_known = true;
  if (argument.spec.kind == BufferSpec::Kind::File) {
    argument.image = read_image(argument.spec.path, about.type, about.dimensions);
    return;
  }
  Shape shape = {{}, argument.spec.extents};
  if (argument.spec.from_estimate) shape = estimated_shape(about);
  const bool has_estimate = about.dimensions == 0 || !shape.extents.empty();
  if (argument.spec.from_query && !(argument.spec.from_estimate && has_estimate)) {
    argument.is_known = false;
    return;
  }
  if (argument.spec.from_estimate && !has_estimate)
    throw Problem(std::string("the generator sets no estimate for \"") + about.name + "\"");
  argument.image = generated_image(about, shape);
}

void Call::set_output(Argument& argument) {
  const halide_filter_argument_t& about = *argument.about;
  argument.path = value_of(argument, std::string());
  if (!options_.output_extents) return;
  Shape shape;
  if (*options_.output_extents == "estimate")
    shape = estimated_shape(about);
  else
    shape.extents = read_extents(*options_.output_extents);
  argument.is_wanted = *options_.output_extents != "estimate" || !shape.extents.empty();
  if (argument.is_wanted) argument.image = generated_image(about, shape);
}

// ---- shapes ----

void Call::guess_outputs() {
  const Image* largest = nullptr;
  for (const Argument& a : arguments_) {
    const bool is_input = is_buffer(a) && !is_output(a) && a.is_known;
    if (is_input && (!largest || a.image.dimensions() > largest->dimensions())) largest = &a.image;
  }
  for (Argument& a : arguments_) {
    if (!is_output(a) || a.is_wanted) continue;
    Shape shape;
    for (int d = 0; d < a.about->dimensions; d++) {
      const int plain = d < 2 ? 1000 : d == 2 ? 3 : 1;
      const bool is_there = largest && d < largest->dimensions();
      shape.mins.push_back(is_there ? largest->dim(d).min() : 0);
      shape.extents.push_back(is_there ? largest->dim(d).extent() : largest ? 1 : plain);
    }
    a.image = generated_image(*a.about, shape);
  }
}

// Runs a bounds query: the shape of every buffer; empty for scalars.
std::vector<Image> Call::query() {
  std::vector<Image> asked;
  std::vector<void*> argv;
  for (Argument& a : arguments_) {
    if (!is_buffer(a)) {
      asked.emplace_back();
    } else if (is_output(a)) {
      asked.emplace_back(a.about->type, nullptr, a.image.dimensions(), a.image.raw_buffer()->dim);
    } else {
      asked.emplace_back(a.about->type, nullptr,
                         std::vector<int>(static_cast<size_t>(a.about->dimensions), 0));
    }
  }
  for (size_t i = 0; i < arguments_.size(); i++) {
    argv.push_back(is_buffer(arguments_[i]) ? static_cast<void*>(asked[i].raw_buffer())
                                            : static_cast<void*>(&arguments_[i].scalar));
  }
  if (const int code = filter_.call(argv.data()))
    throw Problem("the bounds query of the function returned the error code " +
                  std::to_string(code));
  return asked;
}

// Whether an output was made smaller because an input is too small.
bool Call::shrink_outputs() {
  const std::vector<Image> required = query();
  std::map<int, int> excess;  // by dimension
  for (size_t i = 0; i < arguments_.size(); i++) {
    const Argument& a = arguments_[i];
    if (!is_buffer(a) || is_output(a) || !a.is_known) continue;
    for (int d = 0; d < a.image.dimensions(); d++)
      excess[d] = std::max(excess[d], required[i].dim(d).extent() - a.image.dim(d).extent());
  }
  bool shrunk = false;
  for (Argument& a : arguments_) {
    if (!is_output(a) || a.is_wanted) continue;
    for (int d = 0; d < a.image.dimensions(); d++) {
      halide_dimension_t& dim = a.image.raw_buffer()->dim[d];
      const int smaller = std::max(1, dim.extent - excess[d]);
      shrunk = shrunk || smaller != dim.extent;
      dim.extent = smaller;
    }
  }
  return shrunk;
}

// Allocates memory for a shape, with dimensions in the order of its strides.
Image allocated(const std::string& name, Image shape) {
  std::vector<int> order, extents;
  for (int d = 0; d < shape.dimensions(); d++) {
    order.push_back(d);
    extents.push_back(shape.dim(d).extent());
  }
  check_elements(name, extents);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return std::abs(shape.dim(a).stride()) < std::abs(shape.dim(b).stride());
  });
  int64_t stride = 1;
  for (const int d : order) {
    shape.raw_buffer()->dim[d].stride = static_cast<int32_t>(stride);
    stride *= std::max(1, shape.dim(d).extent());
  }
  shape.allocate();
  return shape;
}

void Call::settle(const std::vector<Image>& required) {
  for (size_t i = 0; i < arguments_.size(); i++) {
    Argument& a = arguments_[i];
    if (!is_buffer(a)) continue;
    const halide_buffer_t& shape = *required[i].raw_buffer();
    if (is_output(a) || !a.is_known) {
      a.image =
          allocated(a.about->name, Image(a.about->type, nullptr, shape.dimensions, shape.dim));
      if (!is_output(a)) fill(a.image, a.spec);
      continue;
    }
    // A known image: moves it to the coordinates that are read, and gives it the required layout.
    for (int d = 0; d < shape.dimensions; d++) {
      const int min = a.image.dim(d).min(), extent = a.image.dim(d).extent();
      const bool fits = shape.dim[d].min >= min &&
                        int64_t{shape.dim[d].min} + shape.dim[d].extent <= int64_t{min} + extent;
      if (!fits) a.image.translate(d, shape.dim[d].min - min);
    }
    Image laid_out(a.about->type, nullptr, shape.dimensions, a.image.raw_buffer()->dim);
    for (int d = 0; d < shape.dimensions; d++)
      laid_out.raw_buffer()->dim[d].stride = shape.dim[d].stride;
    laid_out = allocated(a.about->name, laid_out);
    if (a.image.data())
      laid_out.copy_from(a.image);
    else
      fill(laid_out, a.spec);
    a.image = laid_out;
  }
}

// ---- the call ----

int Call::run() {
  std::vector<void*> argv;
  for (Argument& a : arguments_) {
    argv.push_back(is_buffer(a) ? static_cast<void*>(a.image.raw_buffer())
                                : static_cast<void*>(&a.scalar));
  }
  return filter_.call(argv.data());
}

int Call::for_each_result(int (*use)(Image&)) {
  for (Argument& a : arguments_) {
    if (!is_output(a) || !a.image.has_device_allocation()) continue;
    if (const int code = use(a.image)) return code;
  }
  return 0;
}
int Call::wait() {
  return for_each_result([](Image& image) { return image.device_sync(); });
}
int Call::bring_results() {
  return for_each_result([](Image& image) { return image.copy_to_host(); });
}

void Call::write_outputs() const {
  for (const Argument& a : arguments_) {
    if (is_output(a) && !a.path.empty()) write_image(a.path, a.image);
  }
}

double Call::output_elements() const {
  double most = 0;
  for (const Argument& a : arguments_) {
    if (is_output(a)) most = std::max(most, static_cast<double>(a.image.number_of_elements()));
  }
  return most;
}

std::string Call::shapes() const {
  std::string text;
  for (const Argument& a : arguments_) {
    if (!is_buffer(a)) continue;
    text += std::string(a.about->name) + ":";
    for (int d = 0; d < a.image.dimensions(); d++) {
      text += " [" + std::to_string(a.image.dim(d).min()) + ", " +
              std::to_string(a.image.dim(d).min() + a.image.dim(d).extent()) + ")";
    }
    text += "\n";
  }
  return text;
}

}  // namespace retrograde::run_gen
