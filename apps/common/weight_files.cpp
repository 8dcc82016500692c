// weight_files.cpp -- see weight_files.h.
#include "common/weight_files.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "common/json_files.h"
#include "common/process.h"
#include "diagnostics/error.h"

namespace apps {

using retrograde::text;

WeightFile::WeightFile(std::string program, std::filesystem::path path)
    : program_(std::move(program)), path_(std::move(path)) {
  if (const std::string wrong = read_json(path_, json_); !wrong.empty()) refuse(wrong);
}

void WeightFile::read_array(const nlohmann::json& object, const std::string& name,
                            std::span<float> to) const {
  const auto list = object.at(name).get<std::vector<float>>();
  if (list.size() != to.size())
    refuse(text(name, " has ", list.size(), " numbers and not ", to.size()));
  for (const float value : list) {
    if (!std::isfinite(value)) refuse(text(name, " holds a number that is not finite"));
  }
  std::copy(list.begin(), list.end(), to.begin());
}

void WeightFile::refuse(const std::string& evidence) const {
  retrograde::call_error(
      text("read the weights ", retrograde::quoted(path_.string())),
      "a file of weights is JSON as this program writes it, with every array whole", evidence,
      text("Give a file that ", program_, " wrote, or leave --weights out"));
}

nlohmann::json array_of_weights(std::span<const float> values) {
  auto list = nlohmann::json::array();
  for (const float value : values) list.push_back(std::stod(text(value)));
  return list;
}

std::filesystem::path shipped_weights_path(const std::string& program, const std::string& name) {
  const auto here = program_folder();
  const auto installed = here / ".." / "share" / "retrograde" / program / name;
  return std::filesystem::exists(installed) ? installed : here / "weights" / name;
}

}  // namespace apps
