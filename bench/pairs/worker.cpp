// worker.cpp -- see worker.h.
#include "worker.h"

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

#include "worker_protocol.h"

namespace bench {

namespace {

WorkerCommand command_of(Side side, const Job& job, const std::filesystem::path& programs) {
  const char* name = side == Side::Halide ? "bench_kernels_halide" : "bench_kernels_retrograde";
  return {programs / name, {job.kernel, job.small ? "small" : "full", std::to_string(job.threads)}};
}

template <typename T>
std::vector<double> widened(const std::vector<char>& bytes) {
  const T* first = reinterpret_cast<const T*>(bytes.data());
  return {first, first + bytes.size() / sizeof(T)};
}

std::vector<double> as_doubles(const OutputHeader& type, const std::vector<char>& bytes) {
  const int code = type.code * 100 + type.bits;  // signed 0, unsigned 1, float 2
  switch (code) {
    case 8:
      return widened<int8_t>(bytes);
    case 16:
      return widened<int16_t>(bytes);
    case 32:
      return widened<int32_t>(bytes);
    case 108:
      return widened<uint8_t>(bytes);
    case 116:
      return widened<uint16_t>(bytes);
    case 132:
      return widened<uint32_t>(bytes);
    case 232:
      return widened<float>(bytes);
    case 264:
      return widened<double>(bytes);
  }
  throw WorkerError("an output of a type that is not compared");
}

std::vector<Values> read_outputs(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<Values> outputs;
  OutputHeader header;
  while (file.read(reinterpret_cast<char*>(&header), sizeof header)) {
    std::vector<char> bytes(header.count * (header.bits / 8));
    if (!file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
      throw WorkerError("saved outputs are cut short");
    outputs.push_back({header.code != 2, as_doubles(header, bytes)});
  }
  return outputs;
}

}  // namespace

Worker::Worker(Side side, const Job& job, const std::filesystem::path& programs)
    : Worker(side, command_of(side, job, programs), job.threads) {}

Worker::Worker(Side side, const WorkerCommand& command, int threads)
    : side_(side),
      process_(command.program, command.arguments, {{"HL_NUM_THREADS", std::to_string(threads)}}) {
  const std::vector<double> ready = answer("ready");
  if (ready.size() < 4) fail("its first answer has not four numbers");
  compile_seconds = ready[0];
  start_seconds = ready[1];
  bytes = ready[2];
  operations = ready[3];
}

std::vector<double> Worker::answer(const std::string& expected) {
  std::string line;
  for (char c; process_.receive(&c, 1) && c != '\n';) line += c;
  if (line.empty()) fail("the worker ended without an answer");
  std::istringstream words(line);
  std::string word;
  words >> word;
  if (word != expected) fail(line.substr(std::min(line.size(), word.size() + 1)));
  std::vector<double> numbers;
  // Parsed by strtod, because streams reject "inf" and "nan", which a wrong gradient may contain.
  for (std::string number; words >> number;)
    numbers.push_back(std::strtod(number.c_str(), nullptr));
  return numbers;
}

std::vector<double> Worker::ask(const std::string& order, const std::string& expected) {
  const std::string line = order + "\n";
  if (!process_.send(line.data(), line.size())) fail("the worker has ended");
  return answer(expected);
}

void Worker::fail(const std::string& what) const {
  throw WorkerError((side_ == Side::Halide ? "Halide 14: " : "Retrograde: ") + what);
}

void Worker::set_threads(int threads) { ask("threads " + std::to_string(threads), "set"); }

double Worker::run() { return ask("run", "ran").at(0); }

std::vector<Values> Worker::outputs(const std::filesystem::path& scratch) {
  const std::filesystem::path path = scratch / "outputs";
  ask("save " + path.string(), "saved");
  std::vector<Values> values = read_outputs(path);
  std::filesystem::remove(path);
  return values;
}

double Worker::slope_error(const std::filesystem::path& library) {
  const std::string order = library.empty() ? "slope" : "slope " + library.string();
  return ask(order, "slope").at(0);
}

Worker::Memory Worker::memory() {
  const std::vector<double> numbers = ask("memory", "memory");
  return {numbers.at(0), numbers.at(1)};
}

}  // namespace bench
