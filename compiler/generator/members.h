// members.h -- finds the parameters, inputs and outputs of a generator, which are plain members of the user's class. A
// member finds the generator around it by its own address, so users need not list members a second time.
#pragma once

#include <cstddef>
#include <vector>

namespace retrograde::internal {

class GeneratorBase;
class GeneratorParamBase;
class GeneratorInputBase;
class GeneratorOutputBase;

// The parameters, inputs and outputs that are members of one generator.
class GeneratorMembers {
 public:
  // Members are those within `bytes` from `owner`.
  GeneratorMembers(GeneratorBase* owner, size_t bytes);
  ~GeneratorMembers();
  GeneratorMembers(const GeneratorMembers&) = delete;
  GeneratorMembers& operator=(const GeneratorMembers&) = delete;

  // The generator that contains the object at this address, or null.
  static GeneratorMembers* around(const void* object);

  GeneratorBase* owner() const { return owner_; }
  // In the order of their declaration.
  std::vector<GeneratorParamBase*> params;
  std::vector<GeneratorInputBase*> inputs;
  std::vector<GeneratorOutputBase*> outputs;

 private:
  GeneratorBase* owner_;
};

}  // namespace retrograde::internal
