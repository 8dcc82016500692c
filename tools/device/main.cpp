// gpu_check -- checks an NVIDIA GPU against the simulated device.
//
//   gpu_check [--output FILE] [--seconds N]    checks the GPU of this machine
//   gpu_check --simulated                      runs the same checks on the simulated device, to test this program
//
//   --seconds N       approximate time limit (540; on the simulated device 10)
//   --random N        number of random pipelines under random schedules (2000; on the simulated device 5)
//   --first-seed N    seed of the first of them (1)
//   --only NAME       run only this program; may be repeated
//   --python PROGRAM  interpreter that may have PyTorch (python3)
//
// The checks are: the driver compiles kernels of every operator in every type. Results of the GPU and of the simulated
// device agree bit for bit, for pipelines of every operator (those of the differential tests), for the programs of
// test/support/gpu_programs, and for random ones. The programs run under compute-sanitizer, if it is installed. Their
// times are compared with the copy bandwidth and FMA rate measured in the same run, and with PyTorch, if it is
// installed. The results are written as JSON. It builds nothing and needs no network.
//
// Exit status: 0 all checks passed, 1 a check failed, 2 wrong arguments, 77 there is no GPU.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iostream>

#include "arguments.h"
#include "check.h"
#include "device.h"
#include "records.h"
#include "worker.h"

namespace {

using namespace device_check;
namespace fs = std::filesystem;

// Runs one part on the device that the environment selects.
int work(const Arguments& arguments) {
  const retrograde::Target target = target_for(arguments.capability);
  try {
    if (arguments.worker == "times") {
      std::cout << time_programs(target,
                                 {arguments.is_simulated, arguments.seconds, arguments.only})
                << std::endl;
      return 0;
    }
    RecordWriter records(arguments.file);
    if (arguments.worker == "kernels")
      compile_kernels(arguments.capability, arguments.is_simulated, arguments.seconds, records);
    else if (arguments.worker == "programs")
      run_programs(target, arguments.only, records);
    else if (arguments.worker == "operators")
      run_operators(target, arguments.seconds, records);
    else if (arguments.worker == "random")
      run_random(target, arguments.first_seed, arguments.random, arguments.seconds, records);
    else
      usage("there is no worker " + arguments.worker);
    return records.is_good() ? 0 : problems_found;
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return problems_found;
  }
}

// Checked first, because the run takes minutes.
void check_writable(const std::string& path) {
  if (path.empty()) return;
  const fs::path folder = fs::absolute(path).parent_path();
  if (fs::is_directory(path) || access(folder.c_str(), W_OK) != 0)
    usage("\"" + path + "\" cannot be written");
}

int check(const Arguments& arguments) {
  Device device = {"the simulated device", 90, 0, ""};
  if (!arguments.is_simulated) device = find_device();
  if (!device.why_none.empty()) {
    std::cerr << "gpu_check: there is no NVIDIA GPU to check: " << device.why_none
              << ". --simulated checks the simulated device.\n";
    return no_device;
  }
  check_writable(arguments.output);
  std::cout << "gpu_check on " << device.name << std::endl;
  Check all(arguments, device);
  const int status = all.run();
  if (!arguments.output.empty()) {
    std::ofstream file(arguments.output);
    file << all.json().dump(2) << "\n";
    if (!file.good()) usage("\"" + arguments.output + "\" cannot be written");
    std::cout << "written to " << arguments.output << std::endl;
  }
  std::cout << (status == 0 ? "all is well" : "there are problems") << std::endl;
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = arguments_of(argc, argv);
  return arguments.worker.empty() ? check(arguments) : work(arguments);
}
