// Every error code of HalideRuntime.h that CPU code can return: a program whose generated code
// returns it, called without the checks of the front end.
//
// Not covered: the codes of devices, -14 to -19, -23, -32, -33 and -36 to -42, as these programs
// use none; of the Matlab interface, -20 and -21; of an earlier version, -29 and -30. No code here
// returns generic_error (-1) itself: C functions do, and it is passed on. The conditions of
// internal_error (-22), bad_fold (-25) and bad_extern_fold (-35) are CompileErrors here.
#include <HalideRuntime.h>
#include <gtest/gtest.h>

#include "frontend/run/compiler_interface.h"
#include "retrograde/retrograde.h"
#include "support/variables.h"

namespace retrograde {
namespace {

struct Answer {
  int code = 0;
  std::string message;
};

// Arguments in the order of generated code: inputs by first use, then outputs.
Answer call(const Func& f, const std::vector<void*>& argv, const CallContext& given = {}) {
  const auto code =
      default_compiler().compile({f.name(), {f.function()}}, get_jit_target_from_environment());
  EXPECT_EQ(code->arguments().size(), argv.size());
  CallContext context = given;
  JITUserContext nobody;
  context.user_context = &nobody;
  const int result = code->run(argv.data(), context);
  return {result, context.error};
}

void expect_code(halide_error_code_t code, const Answer& answer,
                 std::initializer_list<const char*> phrases) {
  EXPECT_EQ(answer.code, code) << answer.message;
  for (const char* phrase : phrases)
    EXPECT_NE(answer.message.find(phrase), std::string::npos)
        << phrase << " in: " << answer.message;
}

// out(x) = in(x) + in(x + 1)
struct Pair {
  ImageParam in{Int(32), 1, "pair_in"};
  Func f{"pair"};
  Buffer<int> input{9}, output{8};
  Pair() {
    input.fill(1);
    f(x) = in(x) + in(x + 1);
  }
  Answer run() { return call(f, {input.raw_buffer(), output.raw_buffer()}); }
};

TEST(ErrorCodes, Success) {
  Pair p;
  EXPECT_EQ(p.run().code, halide_error_code_success);
  EXPECT_EQ(p.output(7), 2);
}

int fails(halide_buffer_t*) { return halide_error_code_generic_error; }

TEST(ErrorCodes, GenericErrorOfACFunction) {
  Func f("f");
  f.define_extern("fails", {}, Int(32), 1);
  Pipeline pipeline(f);
  Buffer<int> out(4);
  const auto code = default_compiler().compile(
      {f.name(), {f.function()}, {{"fails", reinterpret_cast<void*>(fails)}}},
      get_jit_target_from_environment());
  CallContext context;
  JITUserContext nobody;
  context.user_context = &nobody;
  void* argv[] = {out.raw_buffer()};
  EXPECT_EQ(code->run(argv, context), halide_error_code_generic_error);
}

TEST(ErrorCodes, ExplicitBoundsTooSmall) {
  Func f("f"), g("g");
  g(x) = x;
  g.compute_root().bound(x, 0, 4);
  f(x) = g(x);
  Buffer<int> out(8);
  expect_code(halide_error_code_explicit_bounds_too_small, call(f, {out.raw_buffer()}),
              {"bounded"});
}

TEST(ErrorCodes, BadType) {
  Pair p;
  p.input.raw_buffer()->type = halide_type_of<float>();
  expect_code(halide_error_code_bad_type, p.run(), {"int32"});
}

TEST(ErrorCodes, BadDimensions) {
  Pair p;
  p.input.raw_buffer()->dimensions = 0;
  expect_code(halide_error_code_bad_dimensions, p.run(), {"1 dimensions"});
}

TEST(ErrorCodes, AccessOutOfBounds) {
  Pair p;
  p.input = Buffer<int>(8);
  expect_code(halide_error_code_access_out_of_bounds, p.run(), {"[0, 8]", "[0, 7]"});
}

// Strides so large that element offsets exceed 31 bits, with small extents.
TEST(ErrorCodes, BufferAllocationTooLarge) {
  ImageParam in(Int(32), 2, "wide");
  Func f("f");
  f(x, y) = in(x, y);
  Buffer<int> input(4, 4), output(4, 4);
  input.raw_buffer()->dim[1].stride = 1 << 30;
  expect_code(halide_error_code_buffer_allocation_too_large,
              call(f, {input.raw_buffer(), output.raw_buffer()}), {"\"wide\"", "3221225475"});
  input.raw_buffer()->dim[1].stride = -(1 << 30);
  expect_code(halide_error_code_buffer_allocation_too_large,
              call(f, {input.raw_buffer(), output.raw_buffer()}), {"\"wide\""});
  input.raw_buffer()->dim[1].stride = 4;
  output.raw_buffer()->dim[1].stride = INT32_MAX;
  expect_code(halide_error_code_buffer_allocation_too_large,
              call(f, {input.raw_buffer(), output.raw_buffer()}), {"\"f"});
}

TEST(ErrorCodes, BufferAllocationTooLargeInside) {
  Func f("f"), g("g");
  RDom r(0, 50000);
  g(x, y) = cast<uint8_t>(x + y);
  g.compute_root();
  f(x) = cast<int>(g(x, 49999)) + g(49999, 0);
  Buffer<int> out(4);
  expect_code(halide_error_code_buffer_allocation_too_large, call(f, {out.raw_buffer()}),
              {"\"g", "31 bits"});
}

TEST(ErrorCodes, BufferExtentsTooLarge) {
  ImageParam in(UInt(8), 2, "large");
  Func f("f");
  f(x) = in(x, 0);
  Buffer<uint8_t> input(4, 4), output(4);
  for (int d : {0, 1}) input.raw_buffer()->dim[d].extent = 1 << 16;
  expect_code(halide_error_code_buffer_extents_too_large,
              call(f, {input.raw_buffer(), output.raw_buffer()}), {"\"large\"", "4294967296"});
}

TEST(ErrorCodes, ConstraintsMakeRequiredRegionSmaller) {
  Pair p;
  p.in.dim(0).set_bounds(0, 8);
  expect_code(halide_error_code_constraints_make_required_region_smaller, p.run(),
              {"[0, 8]", "promised"});
}

TEST(ErrorCodes, ConstraintViolated) {
  Pair p;
  p.in.dim(0).set_bounds(0, 10);
  expect_code(halide_error_code_constraint_violated, p.run(), {"promised to be 10", "it is 9"});
}

TEST(ErrorCodes, ParamTooSmallAndTooLarge) {
  Param<int> gain("gain", 2, 1, 5);
  Func f("f");
  f(x) = x * gain;
  Buffer<int> out(4);
  int low = 0, high = 6;
  expect_code(halide_error_code_param_too_small, call(f, {&low, out.raw_buffer()}), {"minimum 1"});
  expect_code(halide_error_code_param_too_large, call(f, {&high, out.raw_buffer()}), {"maximum 5"});
}

TEST(ErrorCodes, OutOfMemory) {
  Func f("f"), g("g");
  g(x) = x;
  g.compute_root();
  f(x) = g(x) + g(x + 1);
  Buffer<int> out(100000);
  CallContext context;
  context.handlers.custom_malloc = [](JITUserContext*, size_t) -> void* { return nullptr; };
  context.handlers.custom_free = [](JITUserContext*, void*) {};
  expect_code(halide_error_code_out_of_memory, call(f, {out.raw_buffer()}, context), {"\"g"});
}

TEST(ErrorCodes, BufferArgumentIsNull) {
  Pair p;
  expect_code(halide_error_code_buffer_argument_is_null,
              call(p.f, {nullptr, p.output.raw_buffer()}), {"pair_in"});
}

TEST(ErrorCodes, DebugToFileFailed) {
  Func f("f");
  f(x) = x;
  f.debug_to_file("/no/such/folder/f.npy");
  Buffer<int> out(4);
  expect_code(halide_error_code_debug_to_file_failed, call(f, {out.raw_buffer()}), {"/no/such"});
}

TEST(ErrorCodes, UnalignedHostPointer) {
  Pair p;
  p.in.set_host_alignment(64);
  Buffer<int> room(64);
  halide_buffer_t moved = *p.input.raw_buffer();
  auto address = (reinterpret_cast<uintptr_t>(room.data()) + 63) / 64 * 64;
  moved.host = reinterpret_cast<uint8_t*>(address + 4);
  expect_code(halide_error_code_unaligned_host_ptr, call(p.f, {&moved, p.output.raw_buffer()}),
              {"multiple of 64", "remainder is 4"});
  moved.host = reinterpret_cast<uint8_t*>(address);
  EXPECT_EQ(call(p.f, {&moved, p.output.raw_buffer()}).code, 0);
}

TEST(ErrorCodes, FoldFactorTooSmall) {
  Func f("f"), g("g");
  Param<int> reach("reach");
  g(x, y) = x + y;
  f(x, y) = g(x, y) + g(x, y + reach);
  g.store_root().compute_at(f, y).fold_storage(y, 4);
  Buffer<int> out(4, 4);
  int far = 9;
  expect_code(halide_error_code_fold_factor_too_small, call(f, {&far, out.raw_buffer()}), {"fold"});
}

TEST(ErrorCodes, RequirementFailed) {
  Param<int> n("n");
  Func f("f");
  f(x) = require(n > 2, x, "n is too small:", n);
  Buffer<int> out(4);
  int two = 2;
  expect_code(halide_error_code_requirement_failed, call(f, {&two, out.raw_buffer()}),
              {"too small"});
}

TEST(ErrorCodes, BufferExtentsNegative) {
  Pair p;
  p.output.raw_buffer()->dim[0].extent = -3;
  expect_code(halide_error_code_buffer_extents_negative, p.run(), {"-3"});
}

TEST(ErrorCodes, SpecializeFail) {
  Param<bool> wide("wide");
  Func f("f");
  f(x) = x;
  f.specialize(wide);
  f.specialize_fail("only wide ones");
  Buffer<int> out(4);
  bool no = false;
  expect_code(halide_error_code_specialize_fail, call(f, {&no, out.raw_buffer()}), {"only wide"});
}

// The data are only on a device.
TEST(ErrorCodes, HostIsNull) {
  Pair p;
  halide_buffer_t away = *p.input.raw_buffer();
  away.host = nullptr;
  away.device = 1;
  expect_code(halide_error_code_host_is_null, call(p.f, {&away, p.output.raw_buffer()}), {"host"});
}

TEST(ErrorCodes, DeviceDirtyWithNoDeviceSupport) {
  Pair p;
  p.input.raw_buffer()->set_device_dirty(true);
  expect_code(halide_error_code_device_dirty_with_no_device_support, p.run(), {"newer copy"});
  p.input.raw_buffer()->set_device_dirty(false);
}

TEST(ErrorCodes, StorageBoundTooSmall) {
  Func f("f"), g("g");
  g(x) = x;
  g.compute_root().bound_storage(x, 4);
  f(x) = g(x) + g(x + 1);
  Buffer<int> out(8);
  expect_code(halide_error_code_storage_bound_too_small, call(f, {out.raw_buffer()}), {"4"});
}

}  // namespace
}  // namespace retrograde
