// Writes the objects and headers that test/unit/aot/aot_call_test.cpp and its neighbours call.
//
//   aot_pipelines <folder> [target]
#include <retrograde/retrograde.h>

#include <cstdio>
#include <exception>
#include <string>
#include <vector>

using namespace retrograde;

namespace {

std::string folder;
Target target;

std::string path(const std::string& name) { return folder + "/" + name; }

void write(Func f, const std::vector<Argument>& args, const std::string& name,
           const Target& wanted) {
  f.compile_to_file(path(name), args, name, wanted);
}

// A stencil with an intermediate buffer on the heap and parallel rows.
Func blur(const ImageParam& in, const Param<int>& offset) {
  Var x("x"), y("y");
  Func rows("rows"), out("blurred");
  rows(x, y) = cast<uint16_t>(in(x, y)) + in(x + 1, y) + in(x + 2, y);
  out(x, y) = cast<uint16_t>((rows(x, y) + rows(x, y + 1) + rows(x, y + 2)) / 9 + offset);
  rows.compute_root().parallel(y).vectorize(x, 8, TailStrategy::RoundUp);
  out.parallel(y).vectorize(x, 8);
  return out;
}

void write_blur() {
  ImageParam in(UInt(8), 2, "in");
  Param<int> offset("offset", 3, -5, 100);
  offset.set_estimate(7);
  in.dim(0).set_estimate(0, 640);
  in.dim(1).set_estimate(-1, 480);
  Func out = blur(in, offset);
  write(out, {in, offset}, "aot_blur", target);
  write(out, {offset, in}, "aot_blur_swapped", target);
  write(out, {in, offset}, "aot_blur_context", target.with_feature(Target::UserContext));
  write(out, {in, offset}, "aot_blur_unchecked", target.with_feature(Target::NoAsserts));
  write(out, {in, offset}, "aot_blur_no_query", target.with_feature(Target::NoBoundsQuery));
  out.compile_to_file(path("aot_blur_mangled"), {in, offset}, "space::inner::aot_blur_mangled",
                      target.with_feature(Target::CPlusPlusMangling));
  out.compile_to({{OutputFileType::registration, path("aot_blur.registration.cpp")}}, {in, offset},
                 "aot_blur", target);
  out.compile_to_static_library(path("aot_blur_alone"), {in, offset}, "aot_blur_alone",
                                target.without_feature(Target::NoRuntime));
}

// One sum out of scalars of every type.
void write_scalars() {
  Param<bool> b("b");
  Param<int8_t> i8("i8");
  Param<uint8_t> u8("u8");
  Param<int16_t> i16("i16");
  Param<uint16_t> u16("u16");
  Param<int32_t> i32("i32");
  Param<uint32_t> u32("u32");
  Param<int64_t> i64("i64");
  Param<uint64_t> u64("u64");
  Param<float> f32("f32");
  Param<double> f64("f64");
  Param<void*> handle("handle");
  Var i("i");
  Func out("scalars");
  Expr values[] = {cast<double>(b),
                   cast<double>(i8),
                   cast<double>(u8),
                   cast<double>(i16),
                   cast<double>(u16),
                   cast<double>(i32),
                   cast<double>(u32),
                   cast<double>(i64),
                   cast<double>(u64),
                   cast<double>(f32),
                   f64};
  Expr sum = values[0];
  for (int k = 1; k < 11; k++) sum = select(i == k, values[k], sum);
  out(i) = sum;
  write(out, {b, i8, u8, i16, u16, i32, u32, i64, u64, f32, f64, handle}, "aot_scalars", target);
}

void write_tuple() {
  ImageParam in(Float(32), 1, "in");
  Var x("x");
  Func out("pair");
  out(x) = Tuple(in(x) + 1.0f, cast<int32_t>(in(x)*2.0f));
  write(out, {in}, "aot_tuple", target);
}

// The same table twice: embedded in the code, and passed by the caller.
void write_table() {
  Buffer<float> table({4, 3}, "table");
  for (int y = 0; y < 3; y++) {
    for (int x = 0; x < 4; x++) table(x, y) = static_cast<float>(10 * y + x);
  }
  table.set_min(-1, 2);
  Var x("x"), y("y");
  Func out("lookup");
  out(x, y) = table(x, y) * 2.0f;
  write(out, {}, "aot_table", target);
  write(out, {table}, "aot_table_given", target);
}

// Vector math, by a vector library or lane by lane.
void write_math() {
  ImageParam in(Float(32), 1, "in");
  Var x("x");
  Func out("math");
  out(x) = sin(in(x)) + exp(in(x)) * pow(in(x), 1.5f);
  out.vectorize(x, 8);
  write(out, {in}, "aot_math", target);
}

// The result shows which variant ran.
void write_variants() {
  std::vector<Target> targets = {target};
  if (target.arch == Target::X86) {
    const std::string base = "x86-64-linux-no_runtime";
    targets = {Target(base + "-sse41-avx-f16c-fma-avx2-avx512-avx512_skylake"),
               Target(base + "-sse41-avx-f16c-fma-avx2"), Target(base)};
  }
  const auto make = [](const std::string& name, const Target& variant) {
    ImageParam in(Float(32), 1, "in");
    Var x("x");
    Func out("variant");
    out(x) = in(x) + static_cast<float>(variant.natural_vector_size<float>());
    out.vectorize(x, variant.natural_vector_size<float>());
    return out.compile_to_module({in}, name, variant);
  };
  compile_multitarget("aot_variants",
                      {{OutputFileType::static_library, path("aot_variants.a")},
                       {OutputFileType::c_header, path("aot_variants.h")}},
                      targets, {}, make);
}

// Uses everything that reports to the caller: prints and requirements.
void write_talker() {
  Param<int> limit("limit");
  Var x("x");
  Func out("talker");
  out(x) = require(x < limit, print(x, "of", limit), "too far:", x);
  write(out, {limit}, "aot_talker", target);
}

// Uses other services of the runtime: traces, memoised results, two stages at once.
void write_services() {
  Param<int> start("start");
  Var x("x");
  Func source("source"), middle("middle"), out("services");
  source(x) = x * x + start;
  middle(x) = source(x) + source(x + 1);
  out(x) = middle(x) * 2;
  source.compute_root().memoize();
  middle.compute_root().async();
  out.trace_stores();
  write(out, {start}, "aot_services", target);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  folder = argv[1];
  target = Target(argc > 2 ? argv[2] : "host-no_runtime");
  try {
    write_blur();
    write_scalars();
    write_tuple();
    write_table();
    write_math();
    write_variants();
    write_talker();
    write_services();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "aot_pipelines: %s\n", e.what());
    return 1;
  }
  return 0;
}
