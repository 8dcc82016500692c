// Loads an object file, or an archive of object files, into executable memory through LLVM's JITLink.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace retrograde::jit {

class LinkedObject {
 public:
  virtual ~LinkedObject() = default;  // unmaps the code
  virtual void* find(const std::string& name) const = 0;
};

using Externs = std::map<std::string, void*>;
std::unique_ptr<LinkedObject> link(const std::vector<uint8_t>& object, const std::string& name,
                                   const Externs& externs = {});

}  // namespace retrograde::jit
