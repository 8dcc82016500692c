#include "workers.h"

#include <algorithm>
#include <filesystem>
#include <thread>

namespace device_check {

std::vector<std::string> Workers::command(const std::string& part, const std::string& file,
                                          double seconds, const Seeds& seeds) const {
  std::vector<std::string> words = {std::filesystem::read_symlink("/proc/self/exe").string(),
                                    "--worker",
                                    part,
                                    "--file",
                                    file,
                                    "--capability",
                                    std::to_string(capability_),
                                    "--seconds",
                                    std::to_string(seconds),
                                    "--random",
                                    std::to_string(seeds.count),
                                    "--first-seed",
                                    std::to_string(seeds.first)};
  for (const std::string& name : arguments_.only) words.insert(words.end(), {"--only", name});
  if (arguments_.is_simulated) words.push_back("--simulated");
  return words;
}

std::map<std::string, std::string> Workers::environment() const {
  if (!arguments_.is_simulated) return {{"RETROGRADE_GPU", "cuda"}};
  return {{"RETROGRADE_GPU", "simulated"},
          {"RETROGRADE_SIMT_ORDER", "random"},
          {"RETROGRADE_CACHE_DIR", code_folder_}};
}

std::map<std::string, std::string> Workers::executor() {
  return {{"RETROGRADE_GPU", "simulated"},
          {"RETROGRADE_SIMT_ORDER", "forward"},
          {"RETROGRADE_SIMT_FAIL", ""}};
}

std::vector<Seeds> Workers::shares() const {
  constexpr int most = 8;
  const int workers =
      std::clamp(static_cast<int>(std::thread::hardware_concurrency()) / 2, 1, most);
  std::vector<Seeds> all;
  uint64_t first = arguments_.first_seed;
  for (int i = 0, left = arguments_.random; i < workers && left > 0; ++i) {
    const int count = (left + workers - i - 1) / (workers - i);
    all.push_back({first, count});
    first += static_cast<uint64_t>(count);
    left -= count;
  }
  return all;
}

std::future<Told> Workers::start(const std::vector<std::string>& command, const std::string& file,
                                 const std::map<std::string, std::string>& variables,
                                 double seconds) {
  return std::async(std::launch::async, [=] {
    Ended ended = run_child(command, variables, seconds);
    return Told{std::move(ended), read_records(file)};
  });
}

}  // namespace device_check
