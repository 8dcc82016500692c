#include "frontend/schedule/print_choices.h"

#include <ostream>

#include "graph/directives/directive_choices.h"

namespace retrograde {

std::ostream& operator<<(std::ostream& out, const Target& target) {
  return out << "target(" << target.to_string() << ")";
}

std::ostream& operator<<(std::ostream& out, TypeCode code) {
  static constexpr const char* names[] = {"int", "uint", "float", "bfloat", "handle"};
  return out << names[static_cast<int>(code)];
}

std::ostream& operator<<(std::ostream& out, DeviceAPI device) {
  static constexpr const char* names[] = {"None",       "Host",          "Default_GPU", "CUDA",
                                          "OpenCL",     "OpenGLCompute", "Metal",       "Hexagon",
                                          "HexagonDma", "D3D12Compute",  "Vulkan",      "WebGPU"};
  return out << names[static_cast<int>(device)];
}

std::ostream& operator<<(std::ostream& out, MemoryType memory) {
  return out << graph::choice_name(memory);
}
std::ostream& operator<<(std::ostream& out, TailStrategy tail) {
  return out << graph::choice_name(tail);
}
std::ostream& operator<<(std::ostream& out, LoopAlignStrategy align) {
  return out << graph::choice_name(align);
}
std::ostream& operator<<(std::ostream& out, PrefetchBoundStrategy bound) {
  return out << graph::choice_name(bound);
}
std::ostream& operator<<(std::ostream& out, Partition partition) {
  return out << graph::choice_name(partition);
}

std::ostream& operator<<(std::ostream& out, const LoopLevel& level) {
  return out << (level.defined() ? level.to_string() : "undefined");
}

}  // namespace retrograde
