// One relocatable object made of two.
#pragma once

#include <string>

namespace retrograde::aot {

// An ELF object with the sections and symbols of both. What `library` defines becomes weak, so that
// several objects that carry the same library can be linked into one program.
std::string merge_objects(const std::string& object, const std::string& library);

}  // namespace retrograde::aot
