// worker_main.cpp -- calls the function of one compiled program on request; it contains no compiler:
//
//   worker LIBRARY CASES CASE_INDEX
//
// It implements ../pairs/worker_protocol.h. A run that is too short to be timed is repeated; the time is that of one
// call among others directly before it.
#include <HalideRuntime.h>
#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <iostream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "../kernels/picture.h"
#include "../pairs/process_memory.h"
#include "../pairs/worker_orders.h"
#include "../pairs/worker_protocol.h"
#include "cases.h"

namespace {

using programs::Argument;
using programs::Role;

constexpr double shortest_seconds = 2e-3;
constexpr int most_calls = 500;

// One argument of the function, with its storage.
class Value {
 public:
  Value(const Argument& argument, uint32_t which) : argument_(argument) {
    buffer_.type = halide_type_t(static_cast<halide_type_code_t>(argument.type.code),
                                 static_cast<uint8_t>(argument.type.bits));
    lay_out();
    bytes_.reset(new (std::align_val_t{128}) char[size_bytes() + 128]);
    buffer_.host = reinterpret_cast<uint8_t*>(bytes_.get());
    if (argument.role != Role::Output)
      fill(which);
    else
      std::memset(bytes_.get(), 0, size_bytes());
  }

  void* address() { return is_scalar() ? static_cast<void*>(bytes_.get()) : &buffer_; }
  bool is_output() const { return argument_.role == Role::Output; }
  bool is_scalar() const { return argument_.role == Role::Scalar; }
  int64_t count() const { return count_; }
  size_t size_bytes() const { return count_ * argument_.type.bits / 8; }
  const Argument& argument() const { return argument_; }
  const char* data() const { return bytes_.get(); }
  float* floats() { return reinterpret_cast<float*>(bytes_.get()); }

 private:
  struct Free {
    void operator()(char* at) const { ::operator delete[](at, std::align_val_t{128}); }
  };

  // Dense, innermost first; interleaved arrays have their third dimension innermost.
  void lay_out() {
    const size_t rank = argument_.extents.size();
    dims_.resize(rank);
    std::vector<size_t> order;
    if (argument_.is_interleaved) order.push_back(2);
    for (size_t d = 0; d < rank; d++) {
      if (!argument_.is_interleaved || d != 2) order.push_back(d);
    }
    for (size_t d : order) {
      const int min = argument_.mins.empty() ? 0 : argument_.mins[d];
      dims_[d] = halide_dimension_t(min, argument_.extents[d], static_cast<int32_t>(count_));
      count_ *= argument_.extents[d];
    }
    buffer_.dimensions = static_cast<int32_t>(rank);
    buffer_.dim = dims_.data();
  }

  // The value at the point whose coordinates, counted from zero in the order of the dimensions, give `index`.
  double number(int64_t index, uint32_t which) const {
    const Argument& a = argument_;
    if (is_scalar()) return a.low;
    double unit = 0;
    if (a.is_noise) {
      const uint32_t n = static_cast<uint32_t>(index) + which * 0x9e3779b9u;
      unit = (kernels::scrambled(n) >> 8) / 16777216.0;
    } else {
      const int width = a.extents[0], height = a.extents.size() > 1 ? a.extents[1] : 1;
      const int rest = static_cast<int>(index / width);
      unit = kernels::picture(static_cast<int>(index % width), rest % height,
                              rest / height + static_cast<int>(which));
    }
    return a.low + (a.high - a.low) * unit;
  }

  template <typename T>
  void fill_as(uint32_t which) {
    T* values = reinterpret_cast<T*>(bytes_.get());
    std::vector<int> at(dims_.size());
    for (int64_t index = 0; index < count_; index++) {
      int64_t offset = 0, rest = index;
      for (const halide_dimension_t& dim : dims_) {
        offset += rest % dim.extent * dim.stride;
        rest /= dim.extent;
      }
      values[offset] = static_cast<T>(number(index, which));
    }
  }

  void fill(uint32_t which) {
    switch (argument_.type.code * 100 + argument_.type.bits) {
      case 8:
        return fill_as<int8_t>(which);
      case 16:
        return fill_as<int16_t>(which);
      case 32:
        return fill_as<int32_t>(which);
      case 108:
        return fill_as<uint8_t>(which);
      case 116:
        return fill_as<uint16_t>(which);
      case 132:
        return fill_as<uint32_t>(which);
      case 232:
        return fill_as<float>(which);
      case 264:
        return fill_as<double>(which);
    }
    throw std::runtime_error("an argument of a type that is not filled");
  }

  Argument argument_;
  halide_buffer_t buffer_{};
  std::vector<halide_dimension_t> dims_;
  int64_t count_ = 1;
  std::unique_ptr<char[], Free> bytes_;
};

using Function = int (*)(void**);

class Worker {
 public:
  Worker(const std::string& library, const std::string& cases, int index) {
    const programs::Program program = programs::read_cases(cases);
    const programs::Case& c = program.cases.at(index);
    for (size_t i = 0; i < c.arguments.size(); i++)
      values_.push_back(std::make_unique<Value>(c.arguments[i], static_cast<uint32_t>(i)));
    for (auto& each : values_) arguments_.push_back(each->address());
    name_ = program.name;
    gradient_count_ = program.gradients;
    function_ = loaded(library, name_);
    std::cout << "ready 0 0 " << bytes() << " 0" << std::endl;
    compile_peak_mb_ = bench::status_mb("VmHWM");
    bench::forget_peak();
    resident_mb_ = bench::status_mb("VmRSS");
  }

  void run() {
    if (calls_ == 0) {
      const double first = std::min(timed(1), timed(1));
      calls_ = std::clamp(static_cast<int>(shortest_seconds / first), 1, most_calls);
    }
    if (calls_ > 1) timed(1);
    std::cout << "ran " << timed(calls_) / calls_ << std::endl;
  }

  void save(const std::string& path) const {
    std::ofstream file(path, std::ios::binary);
    for (const auto& value : values_) {
      if (!value->is_output()) continue;
      const programs::Type type = value->argument().type;
      const bench::OutputHeader header{type.code, type.bits, value->count()};
      file.write(reinterpret_cast<const char*>(&header), sizeof header);
      file.write(value->data(), static_cast<std::streamsize>(value->size_bytes()));
    }
    if (!file.flush()) throw std::runtime_error("cannot write \"" + path + "\"");
    std::cout << "saved" << std::endl;
  }

  // See ../gradients/slope.h; the sum is the first output of the program in `library`.
  void tell_slope(const std::string& library) {
    const Function primal = loaded(library, name_);
    std::vector<Value*> inputs, gradients;
    for (auto& value : values_) {
      if (value->is_output())
        gradients.push_back(value.get());
      else if (inputs.size() < static_cast<size_t>(gradient_count_))
        inputs.push_back(value.get());
    }
    gradients.erase(gradients.begin());
    std::vector<std::unique_ptr<Value>> scratch;
    std::vector<void*> arguments = arguments_;
    for (size_t i = 0; i < values_.size(); i++) {
      if (!values_[i]->is_output()) continue;
      scratch.push_back(std::make_unique<Value>(values_[i]->argument(), 0));
      arguments[i] = scratch.back()->address();
    }
    const auto sum = [&] {
      if (primal(arguments.data()) != 0) throw std::runtime_error("the primal returned an error");
      return *reinterpret_cast<const double*>(scratch[0]->data());
    };
    double worst = 0;
    for (uint32_t direction = 0; direction < 3; direction++)
      worst = std::max(worst, slope_error(inputs, gradients, direction, sum));
    std::cout << "slope " << worst << std::endl;
  }

  void tell_memory() const {
    const double run_peak = bench::status_mb("VmHWM");
    std::cout << "memory " << std::max(compile_peak_mb_, run_peak) << " "
              << std::max(0.0, run_peak - resident_mb_) << std::endl;
  }

 private:
  static Function loaded(const std::string& library, const std::string& name) {
    void* handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!handle) throw std::runtime_error(dlerror());
    void* function = dlsym(handle, (name + "_argv").c_str());
    if (!function) throw std::runtime_error("\"" + name + "_argv\" is not in its library");
    return reinterpret_cast<Function>(function);
  }

  // Along one sign vector: the gradients' product with it against a central difference.
  template <typename Sum>
  static double slope_error(const std::vector<Value*>& inputs, const std::vector<Value*>& gradients,
                            uint32_t direction, const Sum& sum) {
    constexpr float step = 1.0f / 32768;
    const auto sign = [&](size_t input, int64_t element) {
      const auto n = static_cast<uint32_t>(element * 8 + static_cast<int64_t>(input));
      return kernels::scrambled(kernels::scrambled(n) + direction) & 1 ? 1.0f : -1.0f;
    };
    double product = 0, squares = 0;
    for (size_t i = 0; i < inputs.size(); i++) {
      const float* g = gradients[i]->floats();
      for (int64_t k = 0; k < gradients[i]->count(); k++) {
        product += static_cast<double>(g[k]) * sign(i, k);
        squares += static_cast<double>(g[k]) * g[k];
      }
    }
    const auto move = [&](float by) {
      for (size_t i = 0; i < inputs.size(); i++) {
        for (int64_t k = 0; k < inputs[i]->count(); k++) inputs[i]->floats()[k] += by * sign(i, k);
      }
    };
    move(step);
    const double up = sum();
    move(-2 * step);
    const double slope = (up - sum()) / (2 * step);
    move(step);
    return std::abs(product - slope) / std::sqrt(squares);
  }

  // Seconds for this number of calls.
  double timed(int calls) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; i++) {
      const int code = function_(arguments_.data());
      if (code != 0)
        throw std::runtime_error("the function returned error " + std::to_string(code));
    }
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }

  double bytes() const {
    double sum = 0;
    for (const auto& value : values_) sum += static_cast<double>(value->size_bytes());
    return sum;
  }

  std::vector<std::unique_ptr<Value>> values_;
  std::vector<void*> arguments_;
  std::string name_;
  int gradient_count_ = 0;
  Function function_ = nullptr;
  int calls_ = 0;
  double compile_peak_mb_ = 0, resident_mb_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: %s LIBRARY CASES CASE_INDEX\n", argv[0]);
    return 2;
  }
  ::alarm(bench::worker_deadline_seconds);
  std::cout.precision(9);
  try {
    Worker worker(argv[1], argv[2], std::stoi(argv[3]));
    bench::serve(worker, [&](const auto& order, const auto& word, auto&) {
      if (order == "slope") worker.tell_slope(word);
    });
  } catch (const std::exception& error) {
    std::cout << "failed " << error.what() << std::endl;
    return 1;
  }
}
