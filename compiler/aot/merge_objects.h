// One relocatable object made of several.
#pragma once

#include <string>
#include <vector>

namespace retrograde::aot {

// An ELF object with the sections and symbols of both. What `library` defines becomes weak, so that
// several objects that carry the same library can be linked into one program.
std::string merge_objects(const std::string& object, const std::string& library);

// The object of which these are parts (at least one): hidden symbols, by which the parts refer to
// each other, are no longer seen outside of it.
std::string join_parts(const std::vector<std::string>& parts);

}  // namespace retrograde::aot
