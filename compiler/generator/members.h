// What belongs to a generator. Params, inputs and outputs are plain members of the user's class; a
// member finds the generator that it stands in by its address, so that nothing has to be listed
// twice.
#pragma once

#include <cstddef>
#include <vector>

namespace retrograde::internal {

class GeneratorBase;
class GeneratorParamBase;
class GeneratorInputBase;
class GeneratorOutputBase;

class GeneratorMembers {
 public:
  // Members are those within `bytes` from `owner`.
  GeneratorMembers(GeneratorBase* owner, size_t bytes);
  ~GeneratorMembers();
  GeneratorMembers(const GeneratorMembers&) = delete;
  GeneratorMembers& operator=(const GeneratorMembers&) = delete;

  // The generator that holds the object at this address; null for an object on its own.
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
