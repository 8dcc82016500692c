// jpeg_check.h -- whether the data of a JPEG file are whole.
//
// Decoders fill what a cut-off file lacks with grey and say so in a warning that OpenImageIO does not pass on. So the
// file is read once more, at an eighth of its size, where nearly all there is to do is to follow its codes.
#pragma once

#include <filesystem>
#include <string>

namespace apps {

// What the decoder says is wrong with the data of a JPEG file; empty where nothing is.
std::string jpeg_damage(const std::filesystem::path& path);

}  // namespace apps
