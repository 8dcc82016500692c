// calls.cpp -- measures the cost of calling an operator in C++, through PyTorch's dispatcher, on tensors of one
// element.
//
//   calls OPERATOR.so
//
// Writes microseconds as JSON: PyTorch's own sum and ours, without and with a gradient. The result is the least of many
// rounds, in which all take turns.
#include <ATen/ATen.h>
#include <ATen/core/dispatch/Dispatcher.h>
#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

namespace {

constexpr int rounds = 200, calls = 1000;

template <typename Call>
double microseconds(const Call& call) {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < calls; i++) call();
  const std::chrono::duration<double, std::micro> taken = std::chrono::steady_clock::now() - start;
  return taken.count() / calls;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || !dlopen(argv[1], RTLD_NOW | RTLD_GLOBAL)) {
    std::fprintf(stderr, "calls: %s\n", argc != 2 ? "give the operator's library" : dlerror());
    return 1;
  }
  const auto ours = c10::Dispatcher::singleton()
                        .findSchemaOrThrow("overhead::total", "")
                        .typed<at::Tensor(const at::Tensor&, const at::Tensor&)>();
  const at::Tensor a = at::full({1}, 2.0), b = at::full({1}, 3.0);
  const at::Tensor wanting = at::full({1}, 2.0).set_requires_grad(true);
  if (ours.call(wanting, b).item<float>() != 5.0f) return 2;
  double least[4] = {1e9, 1e9, 1e9, 1e9};
  for (int round = 0; round < rounds; round++) {
    const double taken[4] = {
        microseconds([&] { at::add(a, b); }), microseconds([&] { ours.call(a, b); }),
        microseconds([&] { at::add(wanting, b); }), microseconds([&] { ours.call(wanting, b); })};
    for (int i = 0; i < 4; i++) least[i] = std::min(least[i], taken[i]);
  }
  std::printf(
      "{\"PyTorch\": {\"forward\": %.3f, \"forward, gradient wanted\": %.3f}, "
      "\"ours\": {\"forward\": %.3f, \"forward, gradient wanted\": %.3f}}\n",
      least[0], least[2], least[1], least[3]);
}
