// Merges relocatable objects into one.
#pragma once

#include <string>
#include <vector>

namespace retrograde::aot {

// An ELF object with the sections and symbols of both. Symbols that `library` defines become weak, so that several
// objects that embed the same library can be linked into one program.
std::string merge_objects(const std::string& object, const std::string& library);

// Joins the parts of one program (at least one) into one object. The hidden symbols by which parts refer to each other
// become invisible outside.
std::string join_parts(const std::vector<std::string>& parts);

}  // namespace retrograde::aot
