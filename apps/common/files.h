// files.h -- a file is either written whole or not at all.
//
// Bytes go to a temporary file beside the target, are flushed to the disk, and only then take the
// target's name: a full disk or a stopped program leaves the old file (or none), never half a one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace apps {

// Replaces `path` by a file with these bytes. Throws retrograde::UserError.
void write_file(const std::filesystem::path& path, std::string_view bytes);

// Makes the folder when it is missing, and proves by a trial file that it can be written to.
// Throws retrograde::UserError.
void require_writable_folder(const std::filesystem::path& folder);

}  // namespace apps
