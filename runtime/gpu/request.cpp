// Error messages of device calls.
#include "gpu/request.h"

#include "gpu/driver.h"

namespace retrograde::runtime {
namespace {

const char* name_of(const Driver& driver, Result result) {
  const char* name = nullptr;
  return driver.cuGetErrorName(result, &name) == success && name ? name : "an unknown error";
}

const char* text_of(const Driver& driver, Result result) {
  const char* text = nullptr;
  return driver.cuGetErrorString(result, &text) == success && text ? text : "no text";
}

bool is_capture_error(Result result) {
  return result >= capture_unsupported && result <= capture_implicit;
}

const char* advice_for(Result result) {
  if (result == out_of_memory) return "Free device memory, or work on smaller tiles";
  if (is_capture_error(result))
    return "Call it before the capture, or run the pipeline once before it";
  switch (result) {
    case illegal_address:
    case launch_failed:
      return "What is on the host is unharmed; call halide_device_release, or start the process "
             "anew, to use the device again";
    case invalid_image:
    case invalid_source:
      return "Compile for the compute capability of this device, or install a newer driver";
    case not_initialized:
    case no_device:
      return "Check the device with nvidia-smi, or set RETROGRADE_GPU=simulated to use the "
             "simulated one";
    default:
      return "Look up the code in the documentation of CUDA's driver API";
  }
}

}  // namespace

int32_t Request::refuse(int32_t other_code, const char* rule, const char* evidence,
                        const char* advice) const {
  return retrograde_report_error(caller, other_code, "cannot %s: %s; %s. %s.",
                                 static_cast<const char*>(asked_), rule, evidence, advice);
}

int32_t Request::refuse_null_buffer() const {
  return refuse(retrograde_error_buffer_is_null, "there must be a buffer", "the pointer is null",
                "Pass a halide_buffer_t");
}

int32_t Request::driver_failed(const Driver& driver, const char* function, int result,
                               const char* evidence) const {
  const char* separator = *evidence ? ", " : "";
  return refuse("the driver must not fail",
                Line("%s gave %s (%i: %s)%s%s", function, name_of(driver, result), int64_t{result},
                     text_of(driver, result), separator, evidence),
                advice_for(result));
}

}  // namespace retrograde::runtime
