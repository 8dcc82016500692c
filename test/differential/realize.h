// Realizes a Built pipeline. Included like pipelines/common.h, after a function jit_target().

inline const Case& find_case(const std::string& name) {
  for (const Case& one : cases()) {
    if (one.name == name) return one;
  }
  throw std::runtime_error("no differential pipeline " + name);
}

inline std::vector<int> mins_of(const Built& built, size_t output) {
  return built.mins.empty() ? std::vector<int>(built.extents[output].size(), 0)
                            : built.mins[output];
}

inline std::vector<HostBuffer> realize_built(const Built& built) {
  std::vector<Buffer<>> buffers;
  for (size_t i = 0; i < built.outputs.size(); ++i) {
    for (const Type& type : built.outputs[i].output_types()) {
      Buffer<> buffer(type, built.extents[i]);
      buffer.set_min(mins_of(built, i));
      buffers.push_back(buffer);
    }
  }
  Pipeline(built.outputs).realize(Realization(buffers), jit_target());
  std::vector<HostBuffer> result;
  for (Buffer<>& buffer : buffers) result.push_back(HostBuffer(*buffer.raw_buffer()).copy());
  return result;
}

inline Func find_nest(const std::string& name) {
  for (const NestCase& one : nest_cases()) {
    if (one.name == name) return one.build();
  }
  throw std::runtime_error("no loop nest " + name);
}
