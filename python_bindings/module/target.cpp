// target.cpp -- binds Target, its enumerations, and the targets of this machine.
#include "ir/target.h"

#include "bind_all.h"
#include "binding.h"

namespace retrograde::python {

namespace {

void bind_devices(py::module_& m) {
  py::enum_<DeviceAPI> e(m, "DeviceAPI");
#define RETROGRADE_VALUE(name) e.value(#name, DeviceAPI::name)
  RETROGRADE_VALUE(None);
  RETROGRADE_VALUE(Host);
  RETROGRADE_VALUE(Default_GPU);
  RETROGRADE_VALUE(CUDA);
  RETROGRADE_VALUE(OpenCL);
  RETROGRADE_VALUE(OpenGLCompute);
  RETROGRADE_VALUE(Metal);
  RETROGRADE_VALUE(Hexagon);
  RETROGRADE_VALUE(HexagonDma);
  RETROGRADE_VALUE(D3D12Compute);
  RETROGRADE_VALUE(Vulkan);
  RETROGRADE_VALUE(WebGPU);
#undef RETROGRADE_VALUE
}

void bind_parts(Class<Target>& c) {
  py::enum_<Target::OS> os(c, "OS");
  py::enum_<Target::Arch> arch(c, "Arch");
  py::enum_<Target::Processor> processor(c, "Processor");
  py::enum_<Target::Feature> feature(c, "Feature");
#define RETROGRADE_VALUE(e, name) e.value(#name, Target::name)
  RETROGRADE_VALUE(os, OSUnknown);
  RETROGRADE_VALUE(os, Linux);
  RETROGRADE_VALUE(os, Windows);
  RETROGRADE_VALUE(os, OSX);
  RETROGRADE_VALUE(os, Android);
  RETROGRADE_VALUE(os, IOS);
  RETROGRADE_VALUE(os, QuRT);
  RETROGRADE_VALUE(os, NoOS);
  RETROGRADE_VALUE(os, Fuchsia);
  RETROGRADE_VALUE(os, WebAssemblyRuntime);
  RETROGRADE_VALUE(arch, ArchUnknown);
  RETROGRADE_VALUE(arch, X86);
  RETROGRADE_VALUE(arch, ARM);
  RETROGRADE_VALUE(arch, MIPS);
  RETROGRADE_VALUE(arch, Hexagon);
  RETROGRADE_VALUE(arch, POWERPC);
  RETROGRADE_VALUE(arch, WebAssembly);
  RETROGRADE_VALUE(arch, RISCV);
  RETROGRADE_VALUE(processor, ProcessorGeneric);
  RETROGRADE_VALUE(processor, K8);
  RETROGRADE_VALUE(processor, K8_SSE3);
  RETROGRADE_VALUE(processor, AMDFam10);
  RETROGRADE_VALUE(processor, BtVer1);
  RETROGRADE_VALUE(processor, BdVer1);
  RETROGRADE_VALUE(processor, BdVer2);
  RETROGRADE_VALUE(processor, BdVer3);
  RETROGRADE_VALUE(processor, BdVer4);
  RETROGRADE_VALUE(processor, BtVer2);
  RETROGRADE_VALUE(processor, ZnVer1);
  RETROGRADE_VALUE(processor, ZnVer2);
  RETROGRADE_VALUE(processor, ZnVer3);
  RETROGRADE_VALUE(processor, ZnVer4);
#define RETROGRADE_FEATURE(enumerator, name, generated) RETROGRADE_VALUE(feature, enumerator);
#include "ir/target_features.def"
#undef RETROGRADE_FEATURE
  RETROGRADE_VALUE(feature, FeatureEnd);
  RETROGRADE_VALUE(feature, HVX);
#undef RETROGRADE_VALUE
}

void bind_features(Class<Target>& c) {
  c.def("has_feature", &Target::has_feature, py::arg("feature"))
      .def("with_feature", &Target::with_feature, py::arg("feature"))
      .def("without_feature", &Target::without_feature, py::arg("feature"))
      .def("set_feature", &Target::set_feature, py::arg("feature"), py::arg("value") = true)
      .def("set_features", &Target::set_features, py::arg("features"), py::arg("value") = true)
      .def("features_any_of", &Target::features_any_of, py::arg("features"))
      .def("features_all_of", &Target::features_all_of, py::arg("features"))
      .def("set_implied_features", &Target::set_implied_features)
      .def("unset_implied_features", &Target::unset_implied_features)
      .def("sme_streaming_vector_bits", &Target::sme_streaming_vector_bits)
      .def_static("sme_svl_feature_from_bits", &Target::sme_svl_feature_from_bits, py::arg("bits"))
      .def("has_gpu_feature", &Target::has_gpu_feature)
      .def_static("feature_to_name", &Target::feature_to_name, py::arg("feature"))
      .def_static("feature_from_name", &Target::feature_from_name, py::arg("name"));
}

void bind_facts(Class<Target>& c) {
  c.def("natural_vector_size", py::overload_cast<Type>(&Target::natural_vector_size, py::const_),
        py::arg("type"))
      .def("has_unknowns", &Target::has_unknowns)
      .def("has_large_buffers", &Target::has_large_buffers)
      .def("maximum_buffer_size", &Target::maximum_buffer_size)
      .def("supports_type", py::overload_cast<const Type&>(&Target::supports_type, py::const_),
           py::arg("type"))
      .def("supports_type",
           py::overload_cast<const Type&, DeviceAPI>(&Target::supports_type, py::const_),
           py::arg("type"), py::arg("device"))
      .def("supports_device_api", &Target::supports_device_api, py::arg("device"))
      .def("get_required_device_api", &Target::get_required_device_api)
      .def("cuda_capability", &Target::cuda_capability)
      .def("get_cuda_capability_lower_bound", &Target::get_cuda_capability_lower_bound)
      .def("unsupported_part", &Target::unsupported_part)
      .def("supported", &Target::supported)
      .def(
          "get_runtime_compatible_target",
          [](const Target& t, const Target& other) -> std::optional<Target> {
            Target result;
            if (!t.get_runtime_compatible_target(other, result)) return {};
            return result;
          },
          py::arg("other"))
      .def("processor_name", &Target::processor_name)
      .def("to_string", &Target::to_string)
      .def("__str__", &Target::to_string)
      .def("__repr__", [](const Target& t) { return "Target('" + t.to_string() + "')"; })
      .def(
          "__eq__", [](const Target& a, const Target& b) { return a == b; }, py::is_operator())
      .def("__hash__", [](const Target& t) { return std::hash<std::string>()(t.to_string()); });
}

}  // namespace

void bind_target(py::module_& m) {
  bind_devices(m);
  Class<Target> c(m, "Target");
  bind_parts(c);
  c.def(py::init<>())
      .def(py::init<const std::string&>(), py::arg("text"))
      .def(py::init<Target::OS, Target::Arch, int, const std::vector<Target::Feature>&>(),
           py::arg("os"), py::arg("arch"), py::arg("bits"),
           py::arg("features") = std::vector<Target::Feature>())
      .def_static("validate_target_string", &Target::validate_target_string, py::arg("text"))
      .def_readwrite("os", &Target::os)
      .def_readwrite("arch", &Target::arch)
      .def_readwrite("bits", &Target::bits)
      .def_readwrite("vector_bits", &Target::vector_bits)
      .def_readwrite("processor_tune", &Target::processor_tune);
  bind_features(c);
  bind_facts(c);
  py::implicitly_convertible<std::string, Target>();

  def(m, "get_host_target", &get_host_target);
  def(m, "get_target_from_environment", &get_target_from_environment);
  def(m, "get_jit_target_from_environment", &get_jit_target_from_environment);
  def(m, "target_feature_for_device_api", &target_feature_for_device_api, py::arg("device"));
  def(m, "get_default_device_api_for_target", &get_default_device_api_for_target,
      py::arg("target"));
  def(m, "host_supports_target_device", &host_supports_target_device, py::arg("target"));
}

}  // namespace retrograde::python
