// app_errors.h -- runs an app on bad input. It must print an error of one line in four parts, exit with status 1, and
// leave no result behind.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "common/images.h"
#include "support/temporary_folder.h"

class AppErrors : public testing::Test {
 protected:
  AppErrors(std::string name, std::string program)
      : name_(std::move(name)), program_(std::move(program)) {}

  static std::string contents(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }

  // Runs the program through the shell, after `before`, and keeps its status and messages.
  void run(const std::string& arguments, const std::string& before = "") {
    const std::string command = before + " " + program_ + " " + arguments + " >" +
                                (folder_ / "stdout").string() + " 2>" +
                                (folder_ / "stderr").string();
    const int status = std::system(command.c_str());
    status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    message_ = contents(folder_ / "stderr");
  }

  // The last line of standard error is the message; lines of progress may precede it.
  void expect_refused(const std::vector<std::string>& parts, bool after_progress = false) {
    EXPECT_EQ(status_, 1) << message_;
    ASSERT_FALSE(message_.empty());
    EXPECT_EQ(message_.back(), '\n');
    if (!after_progress) {
      EXPECT_EQ(std::count(message_.begin(), message_.end(), '\n'), 1) << message_;
    }
    const size_t start = message_.rfind('\n', message_.size() - 2);
    const std::string line = message_.substr(start == std::string::npos ? 0 : start + 1);
    EXPECT_TRUE(line.starts_with(name_ + ": cannot ")) << line;
    for (const std::string& part : parts) {
      EXPECT_NE(line.find(part), std::string::npos) << "no \"" << part << "\" in: " << line;
    }
  }

  void expect_no_results() {
    if (!std::filesystem::exists(out())) return;
    for (const auto& entry : std::filesystem::directory_iterator(out())) {
      ADD_FAILURE() << "left behind: " << entry.path();
    }
  }

  // Runs the app with these arguments: it must refuse them with this message, and leave no results.
  void refused(const std::vector<std::string>& words, const std::vector<std::string>& parts) {
    std::string line;
    for (const std::string& word : words) line += " '" + word + "'";
    run(line);
    expect_refused(parts);
    expect_no_results();
  }

  void refused_input(const std::filesystem::path& input, const std::vector<std::string>& parts,
                     const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"--input", input, "--output", out()};
    words.insert(words.end(), more.begin(), more.end());
    refused(words, parts);
  }

  // A picture of noise, which compresses badly.
  std::filesystem::path write_noise(const std::string& name, int width, int height,
                                    int channels = 3) {
    apps::Image image{width, height, 8, {}, channels};
    uint32_t noise = 1;
    for (long n = 0; n < image.elems(); ++n) {
      noise = noise * 1664525 + 1013904223;
      image.pixels.push_back(static_cast<float>(noise >> 24) / 255.0f);
    }
    std::filesystem::create_directories((folder_ / name).parent_path());
    apps::write_image(folder_ / name, image);
    return folder_ / name;
  }

  // Checks the error of every app for files that are damaged pictures.
  void expect_refuses_damaged_pictures() {
    refused_input(folder_ / "nowhere.png", {"nowhere.png", "must be an image file"});
    std::ofstream(folder_ / "text.png") << "this is no picture";
    refused_input(folder_ / "text.png", {"text.png", "OpenImageIO decodes"});
    std::filesystem::copy_file(write_noise("whole.png", 300, 200), folder_ / "half.png");
    std::filesystem::resize_file(folder_ / "half.png",
                                 std::filesystem::file_size(folder_ / "half.png") / 2);
    refused_input(folder_ / "half.png", {"half.png", "damaged or truncated"});
    std::filesystem::copy_file(write_noise("whole.jpg", 300, 200), folder_ / "half.jpg");
    std::filesystem::resize_file(folder_ / "half.jpg",
                                 std::filesystem::file_size(folder_ / "half.jpg") / 2);
    refused_input(folder_ / "half.jpg", {"half.jpg", "must be a whole image", "end of"});
  }

  // Checks that the output folder is tried before the run.
  void expect_refuses_unwritable_folder(const std::filesystem::path& input) {
    using std::filesystem::perms;
    // Root may write anywhere except where no file can be created.
    const std::filesystem::path folder = getuid() == 0 ? "/proc" : out();
    if (getuid() != 0) {
      std::filesystem::create_directories(folder);
      std::filesystem::permissions(folder, perms::owner_read | perms::owner_exec);
    }
    run("--input " + input.string() + " --output " + folder.string());
    if (getuid() != 0) std::filesystem::permissions(folder, perms::owner_all);
    expect_refused({"write", "stored whole or not at all", "Give a folder that you may write to"});
  }

  // Checks that the output is neither a file nor, for root, a folder in which no file can be created.
  void expect_refuses_outputs(const std::filesystem::path& input) {
    refused({"--input", input, "--output", input}, {input.filename(), "must be a folder"});
    if (getuid() == 0)
      refused({"--input", input, "--output", "/proc"}, {"Give a folder that you may write to"});
  }

  // Checks that a picture without finite samples is refused.
  void expect_refuses_nan(int side) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    apps::Image image{side, side, 32, std::vector<float>(3 * side * side, nan)};
    apps::write_image(folder_ / "nan.exr", image);
    refused_input(folder_ / "nan.exr", {"nan.exr", "every sample must be a finite number"});
  }

  std::filesystem::path out() const { return folder_ / "out"; }

  const TemporaryFolder temporary_;
  const std::filesystem::path& folder_ = temporary_.path();
  int status_ = 0;
  std::string message_;

 private:
  const std::string name_, program_;
};
