// json_files.h -- files of JSON as users name them, which may be anything.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace apps {

// What is wrong with the file, to be shown to its user; empty where nothing is, and `to` is what it holds. Folders, files
// that are no text and files too large for JSON are named as such, and nothing of them is shown.
std::string read_json(const std::filesystem::path& path, nlohmann::json& to);

// UTF-8 without control characters but those between words and lines: what a terminal can show.
bool is_text(std::string_view bytes);

}  // namespace apps
