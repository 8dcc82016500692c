// files.h -- writes files atomically: completely or not at all.
//
// Data go to a temporary file beside the target and are flushed to disk; then the file gets the target's name. A full
// disk or a stopped program leaves the old file (or none), never a partial one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace apps {

// Replaces `path` by a file with these bytes. Throws retrograde::UserError.
void write_file(const std::filesystem::path& path, std::string_view bytes);

// Creates the folder if it is missing, and tests that it is writable by creating a file in it. Throws
// retrograde::UserError.
void require_writable_folder(const std::filesystem::path& folder);

}  // namespace apps
