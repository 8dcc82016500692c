// weight_files.h -- files of learned weights: JSON with the shape of a model, the origin of its weights, and arrays of
// numbers under their names.
//
//   const apps::WeightFile file("demosaic", path);
//   return file.parse([&](const nlohmann::json& json) {
//     Weights weights({json.at("filters").get<int>(), json.at("size").get<int>()});
//     file.read_array(json, "green", weights.green());
//     return weights;
//   });
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

namespace apps {

// A file of weights that a program wrote. Errors are retrograde::UserError.
class WeightFile {
 public:
  WeightFile(std::string program, std::filesystem::path path);

  // Returns the result of `body` for the contents. An entry that is missing, or of another type than `body` asks for, is
  // an error.
  template <typename Body>
  auto parse(const Body& body) const {
    try {
      return body(json_);
    } catch (const nlohmann::json::exception& error) {
      refuse(error.what());
    }
  }
  // Reads the array `name` of an object in the file: as many numbers as `to` has, and all finite.
  void read_array(const nlohmann::json& object, const std::string& name, std::span<float> to) const;
  [[noreturn]] void refuse(const std::string& evidence) const;

 private:
  std::string program_;
  std::filesystem::path path_;
  nlohmann::json json_;
};

// An array for such a file. Six digits; the values are used as the file stores them, so no further precision is lost.
nlohmann::json array_of_weights(std::span<const float> values);

// A file of weights that comes with a program, in its folder or where it is installed.
std::filesystem::path shipped_weights_path(const std::string& program, const std::string& name);

}  // namespace apps
