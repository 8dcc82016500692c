#include "tuning/keep_machine.h"

#include <sys/stat.h>

#include "autoschedule/machine/kept_machine.h"
#include "diagnostics/error.h"
#include "jit/private_folder.h"

namespace retrograde::tuning {

std::string keep_machine(const planning::Machine& machine) {
  const std::string folder = planning::cache_folder(), file = planning::kept_file_name(),
                    asked = "keep the figures of the machine";
  if (folder.empty()) {
    user_error(
        asked, "the cache folder can be written", "neither XDG_CACHE_HOME nor HOME is set",
        "Set one, or write them to a file: out/build/release/tools/tune --machine --output FILE");
  }
  mkdir(folder.substr(0, folder.rfind('/')).c_str(),
        0700);  // if it fails, the next step reports it
  const jit::PrivateFolder files(folder, asked);
  if (!files.write(file, machine.to_json(), true)) {
    user_error(asked, "the cache folder can be written", retrograde::quoted(folder) + " cannot",
               "Name another one by XDG_CACHE_HOME");
  }
  return folder + "/" + file;
}

}  // namespace retrograde::tuning
