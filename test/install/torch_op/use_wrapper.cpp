// Calls functions on tensors through the wrappers that generators write: on the CPU, and as kernels
// on the simulated device, whose memory PyTorch sees as the CPU's.
//
//   use_wrapper DRIVER      DRIVER: libretrograde_simt.so
#include <dlfcn.h>
#include <torch/types.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#define RETROGRADE_TORCH_DEVICE at::kCPU
#include "weighted_forward.pytorch.h"
#include "weighted_gradient.pytorch.h"
#include "weighted_on_device_forward.pytorch.h"
#include "weighted_on_device_gradient.pytorch.h"

namespace {

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "%s\n", what);
  std::exit(1);
}

class Device {
 public:
  explicit Device(const char* driver) : driver_(dlopen(driver, RTLD_NOW)) {
    require(driver_, "no driver");
    void* context = nullptr;
    call<unsigned>("cuInit", 0);
    call<void**, int>("cuDevicePrimaryCtxRetain", &context, 0);
    call<void*>("cuCtxSetCurrent", context);
  }
  at::Tensor tensor(const at::Tensor& values) const {
    uint64_t address = 0;
    call<uint64_t*, size_t>("cuMemAlloc_v2", &address, values.nbytes());
    at::Tensor made =
        torch::from_blob(reinterpret_cast<void*>(address), values.sizes(), values.options());
    return made.copy_(values);
  }
  void wait() const { call<>("cuCtxSynchronize"); }

 private:
  template <class... Args>
  void call(const char* name, Args... args) const {
    require(reinterpret_cast<int (*)(Args...)>(dlsym(driver_, name))(args...) == 0, name);
  }
  void* driver_;
};

}  // namespace

int main(int, char** argv) {
  setenv("RETROGRADE_GPU", "simulated", 1);
  setenv("RETROGRADE_SIMT_LIBRARY", argv[1], 1);
  halide_set_error_handler(retrograde_torch::note_error);  // makes exceptions carry the message
  const Device device(argv[1]);
  const at::Tensor image = torch::rand({5, 9}), taps = torch::rand({3});
  const at::Tensor seeds[] = {torch::rand({5, 7}), torch::rand({5, 9})};
  at::Tensor here[] = {torch::zeros({5, 7}), torch::zeros({5, 9}), torch::zeros({5, 9}),
                       torch::zeros({3}), torch::zeros({})};
  at::Tensor there[5];
  for (int i = 0; i < 5; i++) there[i] = device.tensor(here[i]);

  require(weighted_forward_th_(image, taps, 1.5, false, here[0], here[1]) == 0, "the CPU's code");
  require(weighted_gradient_th_(image, taps, 1.5, false, seeds[0], seeds[1], here[2], here[3],
                                here[4]) == 0,
          "the CPU's gradient");
  const at::Tensor placed = device.tensor(image), placed_taps = device.tensor(taps);
  require(weighted_on_device_forward_th_(placed, placed_taps, 1.5, false, there[0], there[1]) == 0,
          "kernels");
  require(
      weighted_on_device_gradient_th_(placed, placed_taps, 1.5, false, device.tensor(seeds[0]),
                                      device.tensor(seeds[1]), there[2], there[3], there[4]) == 0,
      "the gradient's kernels");
  require(here[0].abs().max().item<float>() > 0, "results are zeros");
  require(there[0].abs().max().item<float>() == 0, "a call waits for its kernels");
  device.wait();
  for (int i = 0; i < 5; i++)
    require(at::allclose(here[i], there[i], 1e-5, 1e-5), "kernels give other values");

  // Memory that the driver does not know is rejected.
  try {
    weighted_on_device_forward_th_(image, placed_taps, 1.5, false, there[0], there[1]);
    require(false, "no error");
  } catch (const c10::Error& error) {
    require(std::string(error.what()).find("cuPointerGetAttribute") != std::string::npos,
            error.what());
  }
  std::puts("kernels agree with the CPU's code");
}
