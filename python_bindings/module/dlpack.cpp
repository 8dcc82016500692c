// dlpack.cpp -- converts Buffers to and from DLPack, with capsules of both protocols, "dltensor" and
// "dltensor_versioned". The structures are those of version 1.0 of the standard
// (https://dmlc.github.io/dlpack/latest/c_api.html). Only CPU memory is supported.
#include <memory>

#include "buffer_memory.h"
#include "casters.h"
#include "diagnostics/error.h"

namespace retrograde::python {

namespace {

namespace dl {
struct Version {
  uint32_t major, minor;
};
struct Device {
  int32_t type, id;
};
struct DataType {
  uint8_t code, bits;
  uint16_t lanes;
};
struct Tensor {
  void* data;
  Device device;
  int32_t ndim;
  DataType dtype;
  int64_t* shape;
  int64_t* strides;  // in elements; null: dense
  uint64_t byte_offset;
};
struct Managed {
  Tensor tensor;
  void* context;
  void (*deleter)(Managed*);
};
struct ManagedVersioned {
  Version version;
  void* context;
  void (*deleter)(ManagedVersioned*);
  uint64_t flags;
  Tensor tensor;
};
constexpr int32_t cpu = 1;
constexpr uint8_t int_code = 0, uint_code = 1, float_code = 2, bfloat_code = 4, bool_code = 6;
constexpr uint64_t flag_read_only = 1;
constexpr const char* name_of(const Managed*) { return "dltensor"; }
constexpr const char* name_of(const ManagedVersioned*) { return "dltensor_versioned"; }
constexpr const char* used_name_of(const Managed*) { return "used_dltensor"; }
constexpr const char* used_name_of(const ManagedVersioned*) { return "used_dltensor_versioned"; }
}  // namespace dl

std::optional<Type> type_of(const dl::DataType& type) {
  if (type.lanes != 1) return {};
  switch (type.code) {
    case dl::int_code:
      return Int(type.bits);
    case dl::uint_code:
      return UInt(type.bits);
    case dl::float_code:
      return Float(type.bits);
    case dl::bfloat_code:
      return BFloat(type.bits);
    case dl::bool_code:
      return Bool();
    default:
      return {};
  }
}

dl::DataType dl_type(Type type) {
  const uint8_t code = type.is_bool()     ? dl::bool_code
                       : type.is_int()    ? dl::int_code
                       : type.is_uint()   ? dl::uint_code
                       : type.is_bfloat() ? dl::bfloat_code
                                          : dl::float_code;
  return {code, static_cast<uint8_t>(type.is_bool() ? 8 : type.bits()), 1};
}

// ---- import ----

ArrayMemory described(const dl::Tensor& tensor) {
  const std::optional<Type> type = type_of(tensor.dtype);
  if (!type || tensor.device.type != dl::cpu) {
    user_error(
        "use a DLPack tensor as a Buffer", "it holds numbers in the memory of the CPU",
        text("it is on a device of kind ", tensor.device.type, " and its elements have code ",
             int(tensor.dtype.code), " and ", int(tensor.dtype.bits), " bits"),
        "Copy it to the CPU first");
  }
  ArrayMemory memory;
  memory.data = static_cast<char*>(tensor.data) + tensor.byte_offset;
  memory.type = *type;
  memory.shape.assign(tensor.shape, tensor.shape + tensor.ndim);
  int64_t dense = type->bytes();
  memory.strides_bytes.resize(tensor.ndim);
  for (int i = tensor.ndim; i-- > 0;) {
    memory.strides_bytes[i] = tensor.strides ? tensor.strides[i] * type->bytes() : dense;
    dense *= tensor.shape[i];
  }
  return memory;
}

// Takes ownership of the tensor: renames its capsule, as the standard requires, and keeps the tensor in another
// capsule.
template <class Managed>
std::optional<ArrayMemory> consumed(const py::object& capsule, bool read_only) {
  const char* name = dl::name_of(static_cast<Managed*>(nullptr));
  if (!PyCapsule_IsValid(capsule.ptr(), name)) return {};
  auto* managed = static_cast<Managed*>(PyCapsule_GetPointer(capsule.ptr(), name));
  ArrayMemory memory = described(managed->tensor);
  if constexpr (requires { managed->flags; }) read_only = managed->flags & dl::flag_read_only;
  memory.read_only = read_only;
  PyCapsule_SetName(capsule.ptr(), dl::used_name_of(managed));
  PyCapsule_SetDestructor(capsule.ptr(), nullptr);
  memory.owner = py::capsule(managed, [](void* kept) {
    auto* tensor = static_cast<Managed*>(kept);
    if (tensor->deleter) tensor->deleter(tensor);
  });
  return memory;
}

// ---- export ----

// Data of a capsule; the Buffer keeps the memory and its owner alive.
template <class Managed>
struct Given {
  Managed managed{};
  Buffer<> buffer;
  Runtime::Buffer<> memory;
  std::vector<int64_t> shape, strides;
};

template <class Managed>
void delete_given(Managed* managed) {
  delete static_cast<Given<Managed>*>(managed->context);
}

void check_exportable(const ArrayMemory& memory) {
  for (size_t i = 0; i < memory.shape.size(); i++) {
    if (memory.strides_bytes[i] < 0 && memory.shape[i] > 1) {
      throw py::buffer_error(
          "DLPack tensors have no negative strides, and this Buffer has one: copy it first");
    }
  }
}

template <class Managed>
py::capsule exported(const Buffer<>& buffer) {
  const ArrayMemory memory = memory_of(buffer);
  check_exportable(memory);
  auto* kept = new Given<Managed>;
  kept->buffer = buffer;
  kept->memory = buffer.contents()->buffer;
  kept->shape = memory.shape;
  for (const int64_t stride : memory.strides_bytes) {
    kept->strides.push_back(stride / memory.type.bytes());
  }
  kept->managed.tensor = {memory.data,
                          {dl::cpu, 0},
                          static_cast<int32_t>(kept->shape.size()),
                          dl_type(memory.type),
                          kept->shape.data(),
                          kept->strides.data(),
                          0};
  kept->managed.context = kept;
  kept->managed.deleter = delete_given<Managed>;
  if constexpr (requires { kept->managed.flags; }) {
    kept->managed.version = {1, 0};
    kept->managed.flags = memory.read_only ? dl::flag_read_only : 0;
  }
  return py::reinterpret_steal<py::capsule>(
      PyCapsule_New(&kept->managed, dl::name_of(&kept->managed), [](PyObject* capsule) {
        // The capsule was not consumed.
        const char* name = dl::name_of(static_cast<Managed*>(nullptr));
        if (!PyCapsule_IsValid(capsule, name)) return;
        auto* managed = static_cast<Managed*>(PyCapsule_GetPointer(capsule, name));
        managed->deleter(managed);
      }));
}

}  // namespace

std::optional<ArrayMemory> dlpack_memory(py::handle object) {
  if (!py::hasattr(object, "__dlpack__")) return {};
  py::object capsule;
  try {
    capsule = object.attr("__dlpack__")(py::arg("max_version") = py::make_tuple(1, 0));
  } catch (py::error_already_set& error) {
    if (!error.matches(PyExc_TypeError))
      throw;  // TypeError: the library knows only the first protocol
    capsule = object.attr("__dlpack__")();
  }
  if (auto memory = consumed<dl::ManagedVersioned>(capsule, false)) return memory;
  if (auto memory = consumed<dl::Managed>(capsule, false)) return memory;
  throw py::buffer_error("__dlpack__ gave no DLPack capsule");
}

py::capsule dlpack_capsule(const Buffer<>& buffer, bool versioned) {
  // The first protocol cannot mark memory as read-only.
  if (!versioned && is_read_only(buffer)) {
    throw py::buffer_error(
        "the Buffer is read only, which DLPack before 1.0 cannot say: copy it first");
  }
  return versioned ? exported<dl::ManagedVersioned>(buffer) : exported<dl::Managed>(buffer);
}

}  // namespace retrograde::python
