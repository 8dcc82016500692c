// members.cpp -- a table of the existing generators by address.
#include "generator/members.h"

#include <functional>
#include <map>
#include <mutex>

namespace retrograde::internal {

namespace {

struct Extent {
  size_t bytes;
  GeneratorMembers* members;
};
// The generators by their begin address. Objects may nest but never overlap partially, so a search for an address needs
// no end addresses.
struct Alive {
  std::mutex mutex;
  std::multimap<const char*, Extent, std::less<>> by_begin;
};
Alive& alive() {
  static Alive result;
  return result;
}

}  // namespace

GeneratorMembers::GeneratorMembers(GeneratorBase* owner, size_t bytes) : owner_(owner) {
  std::lock_guard lock(alive().mutex);
  alive().by_begin.emplace(reinterpret_cast<const char*>(owner), Extent{bytes, this});
}

GeneratorMembers::~GeneratorMembers() {
  std::lock_guard lock(alive().mutex);
  auto& generators = alive().by_begin;
  auto [i, end] = generators.equal_range(reinterpret_cast<const char*>(owner_));
  while (i != end && i->second.members != this) ++i;
  if (i != end) generators.erase(i);
}

GeneratorMembers* GeneratorMembers::around(const void* object) {
  const char* address = static_cast<const char*>(object);
  std::lock_guard lock(alive().mutex);
  const auto& generators = alive().by_begin;
  // The innermost generator around an address is the one that begins nearest below it.
  for (auto i = generators.upper_bound(address); i != generators.begin();) {
    --i;
    if (address < i->first + i->second.bytes) return i->second.members;
  }
  return nullptr;
}

}  // namespace retrograde::internal
