#include "codegen/device/kernel_code.h"

#include <algorithm>
#include <cctype>

#include "codegen/function_generator.h"
#include "codegen/llvm/unit.h"
#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "ir/lists.h"
#include "ir/visit.h"

namespace retrograde::codegen {
namespace {

// ---- PTX text ----
//
//   .visible .entry kernel_f_0(        or   .func (.param .b32 func_retval0) name(
//     ...
//   )
//   {
//     .local .align 16 .b8 __local_depot0[64];
//     ...
//   }

struct Function {
  std::string name;
  bool is_kernel = false;
  int64_t local_bytes = 0;
  std::string_view body;  // up to the next function
};

bool is_of_name(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '$' || c == '.';
}

std::string word_at(std::string_view text, size_t begin) {
  size_t end = begin;
  while (end < text.size() && is_of_name(text[end])) end++;
  return std::string(text.substr(begin, end - begin));
}

bool has(std::string_view line, std::string_view part) {
  return line.find(part) != std::string_view::npos;
}

// The name in a line that begins a function: the word before the bracket that opens its parameters.
std::string name_in(std::string_view line) {
  size_t end = line.find_last_of('(');
  if (end == std::string_view::npos) end = line.size();
  while (end > 0 && !is_of_name(line[end - 1])) end--;
  size_t begin = end;
  while (begin > 0 && is_of_name(line[begin - 1])) begin--;
  return std::string(line.substr(begin, end - begin));
}

bool begins_function(std::string_view line) {
  return has(line, ".entry ") || line.substr(0, 5) == ".func" || has(line, " .func");
}

int64_t local_bytes_in(std::string_view line) {
  const size_t bracket = line.find('[');
  const bool is_depot = has(line, ".local") && has(line, "__local_depot");
  return is_depot && bracket != std::string_view::npos ? std::stoll(word_at(line, bracket + 1)) : 0;
}

std::vector<Function> functions_of(std::string_view ptx) {
  std::vector<Function> functions;
  for (size_t begin = 0, end; begin < ptx.size(); begin = end + 1) {
    end = std::min(ptx.find('\n', begin), ptx.size());
    const std::string_view line = ptx.substr(begin, end - begin);
    if (begins_function(line)) {
      functions.push_back({name_in(line), has(line, ".entry "), 0, ptx.substr(end, 0)});
    } else if (!functions.empty()) {
      Function& own = functions.back();
      own.local_bytes += local_bytes_in(line);
      own.body = {own.body.data(), static_cast<size_t>(ptx.data() + end - own.body.data())};
    }
  }
  return functions;
}

// Includes the functions that the kernel calls. They are leaves, so one level is enough.
int64_t bytes_with_called(const Function& kernel, const std::vector<Function>& functions) {
  int64_t bytes = kernel.local_bytes;
  for (const Function& other : functions) {
    if (!other.is_kernel && other.local_bytes > 0 && has(kernel.body, other.name))
      bytes += other.local_bytes;
  }
  return bytes;
}

}  // namespace

std::map<std::string, int64_t> local_bytes_by_kernel(std::string_view ptx) {
  std::map<std::string, int64_t> result;
  const std::vector<Function> functions = functions_of(ptx);
  for (const Function& function : functions) {
    if (!function.is_kernel) continue;
    const int64_t bytes = bytes_with_called(function, functions);
    if (bytes > 0) result[function.name] = bytes;
  }
  return result;
}

std::string local_memory_note(const std::string& kernel, int64_t bytes) {
  return text(
      "performance note: each thread of the kernel ", quoted(kernel), " keeps ", bytes,
      " bytes in local memory, which is slow device memory: arrays cannot be in registers if "
      "their indices are unknown at compile time. Unroll the loops over these arrays, make them "
      "smaller, or compute the Func at a loop over blocks, which keeps it in shared memory.");
}

KernelCode compile_kernels(const ir::LoweredFunction& function, const Options& options) {
  KernelCode code;
  bool has_kernels = false;
  ir::walk(function.body, [&](const ir::Launch&) { has_kernels = true; });
  if (!has_kernels) return code;
  run_on_large_stack([&] {
    const Machine machine = machine_for(options.target, options.tune_for_host);
    Unit unit(machine, function.name, /*keep_names=*/false);
    Emitter emitter(unit.module(), machine);
    FunctionGenerator generator(emitter, function);
    generator.generate();
    code = generator.kernels().described_code();
  });
  const std::map<std::string, int64_t> local = local_bytes_by_kernel(code.ptx);
  for (KernelCode::Kernel& kernel : code.kernels)
    kernel.local_bytes = ir::value_or(local, kernel.symbol, int64_t{0});
  return code;
}

}  // namespace retrograde::codegen
