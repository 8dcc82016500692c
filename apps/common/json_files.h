// json_files.h -- reads JSON files that users name, which may contain anything.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace apps {

// Returns an error message for the user, or an empty text after storing the file's contents in `to`. Folders, files
// that are not text and files too large for JSON are named as such; their contents are not shown.
std::string read_json(const std::filesystem::path& path, nlohmann::json& to);

// Whether this is UTF-8 without control characters other than white space, so that a terminal can show it.
bool is_text(std::string_view bytes);

}  // namespace apps
