// An object file brought into executable memory by LLVM's JITLink.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace retrograde::jit {

class LinkedObject {
 public:
  virtual ~LinkedObject() = default;  // unmaps the code
  virtual void* find(const std::string& name) const = 0;
};

std::unique_ptr<LinkedObject> link(const std::vector<uint8_t>& object, const std::string& name);

}  // namespace retrograde::jit
