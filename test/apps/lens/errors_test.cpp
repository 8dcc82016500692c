// Tests the errors of lens for impossible prescriptions and bad options: one line in four parts, status 1, and no
// results.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "support/app_errors.h"

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class AppLensErrors : public AppErrors {
 protected:
  AppLensErrors() : AppErrors("lens", LENS_PROGRAM) {}

  static json tessar() {
    std::ifstream file(LENS_PRESCRIPTIONS "/tessar_1903.json");
    return json::parse(file);
  }

  void refuse_text(const std::string& text, const std::vector<std::string>& parts,
                   const std::vector<std::string>& more = {}) {
    const fs::path input = folder_ / "lens.json";
    std::ofstream(input) << text;
    std::string line = "--input " + input.string() + " --output " + out().string();
    for (const std::string& word : more) line += " " + word;
    run(line);
    expect_refused(parts);
    expect_no_results();
  }
  void refuse(const json& lens, const std::vector<std::string>& parts,
              const std::vector<std::string>& more = {}) {
    refuse_text(lens.dump(), parts, more);
  }
};

TEST_F(AppLensErrors, OtherFilesAreNoPrescriptions) {
  refuse_text("", {"a prescription is JSON"});
  refuse_text("{\"surfaces\": [", {"a prescription is JSON"});
  // The message says that the file is binary, without printing bytes that a terminal cannot show.
  for (const std::string binary :
       {"\x89PNG\r\n\x1a\n", "{\"name\": \"\xc3\x28\"}", "{\"\x1b[31m\": 1}",
        "{\"\xc2\x9b"
        "31m\": 1}",
        "\xff\xfe{"}) {
    refuse_text(binary, {"it is a binary file"});
    EXPECT_TRUE(std::all_of(message_.begin(), message_.end(), [](char c) {
      return c == '\n' || (c >= ' ' && c <= '~');
    })) << message_;
  }
  run("--input " + folder_.string() + " --output " + out().string());
  expect_refused({"it is a folder"});
  refuse_text(std::string(5000, '['), {"a prescription is JSON"});
  EXPECT_LT(message_.size(), 1000u);
  refuse_text("[1, 2]", {"a list of \"surfaces\""});
  refuse_text("{\"surfaces\": 3}", {"a list of \"surfaces\""});
  refuse_text("{\"surfaces\": []}", {"2 to 60 surfaces", "it has 0"});
}

TEST_F(AppLensErrors, NumbersMustBeNumbers) {
  json lens = tessar();
  lens["surfaces"][0]["radius"] = "large";
  refuse(lens, {"\"radius\" must be a number", "large"});
  lens = tessar();
  lens["surfaces"][1].erase("spacing");
  refuse(lens, {"every spacing given but the last", "surface 2"});
  lens = tessar();
  lens["surfaces"][2] = 7;
  refuse(lens, {"a surface is an object"});
}

TEST_F(AppLensErrors, ImpossibleLensesAreRefused) {
  json lens = tessar();
  lens["surfaces"][0]["spacing"] = -0.1;
  refuse(lens, {"a spacing is not negative", "surface 1 has -10 mm"});
  lens = tessar();
  lens["surfaces"][3]["radius"] = 0.05;
  refuse(lens, {"a rim lies within the surface's equator", "surface 4, of radius 5 mm"});
  lens = tessar();
  lens["surfaces"][6]["spacing"] = 0.001;
  refuse(lens, {"surfaces do not cross within their rims", "surfaces 7 and 8 overlap"});
  lens = tessar();
  lens["surfaces"][0]["n_D"] = 0.5;
  refuse(lens, {"an index lies between 1 and 4"});
  lens = tessar();
  lens["surfaces"].erase(4);
  refuse(lens, {"one surface is the stop", "none is"});
  lens = tessar();
  lens["f_number"] = 0;
  refuse(lens, {"an F-number lies between 0.5 and 1000"});
  lens = tessar();
  lens["half_field_degrees"] = 80;
  refuse(lens, {"half a field lies between 0 and 60 degrees"});
}

TEST_F(AppLensErrors, ALensWithoutAnImageIsRefused) {
  json lens = tessar();
  for (json& surface : lens["surfaces"]) surface["radius"] = nullptr;
  refuse(lens, {"a lens forms a real image behind it", "its power is"});
}

TEST_F(AppLensErrors, AFieldWithoutLightIsRefused) {
  json lens = tessar();
  for (json& surface : lens["surfaces"]) surface["semi_aperture"] = 0.02;
  refuse(lens, {"light of every field must arrive", "degrees 0 % of it does"});
}

TEST_F(AppLensErrors, OptionsHaveRanges) {
  refuse(tessar(), {"--shorter", "must lie between 0 and 60"}, {"--shorter", "90"});
  refuse(tessar(), {"optimize by \"luck\"", "newton_cg"}, {"--method", "luck"});
  refuse(tessar(), {"no \"glass\" to optimize, but curvatures"}, {"--optimize", "glass"});
  refuse(tessar(), {"--wavelengths"}, {"--wavelengths", "4"});
  refuse(tessar(), {"resume from", "no such file can be read"}, {"--resume"});
}

TEST_F(AppLensErrors, AMissingFileIsNamed) {
  run("--input " + (folder_ / "none").string() + " --output " + out().string());
  expect_refused({"no such file can be read"});
  expect_no_results();
}

}  // namespace
