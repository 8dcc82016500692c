// Instruction patterns on which speed depends: shuffles instead of gathers, accumulators in
// registers. Each test compiles for AVX2 or AVX-512 on any machine and inspects the assembly; other
// tests check the results. Small loops are unrolled, so a block holds two or four of their
// iterations.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>
#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "codegen/codegen.h"
#include "ir/build.h"
#include "lower/lower.h"
#include "support/errors.h"

namespace retrograde {
namespace {

std::vector<std::string> assembly(const Func& f, const std::string& target) {
  const std::vector<graph::FuncPtr> outputs{f.function()};
  lower::LowerOptions lowering;
  lowering.target = Target(target);
  codegen::Options options;
  options.target = Target(target);
  options.tune_for_host = false;
  const ir::LoweredFunction lowered =
      lower::lower("f", outputs, lower::infer_arguments(outputs), lowering);
  std::istringstream text(codegen::compile_assembly(lowered, options));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

size_t count(const std::vector<std::string>& lines, const std::string& what) {
  return static_cast<size_t>(std::count_if(lines.begin(), lines.end(), [&](const std::string& s) {
    return s.find(what) != std::string::npos;
  }));
}

// The lines of the block between labels that contains `what` most often: the hottest block.
std::vector<std::string> block_with_most(const std::vector<std::string>& lines,
                                         const std::string& what) {
  std::vector<std::string> best, block;
  for (const std::string& line : lines) {
    if (!line.empty() && line[0] != '\t' && line[0] != ' ') block.clear();
    block.push_back(line);
    if (count(block, what) > count(best, what)) best = block;
  }
  return best;
}

const char* const avx2 = "x86-64-linux-sse41-avx-avx2-f16c-fma";
const char* const avx512 = "x86-64-linux-sse41-avx-avx2-f16c-fma-avx512-avx512_skylake";

TEST(CodegenIdioms, NeighbouringStridedLoadsAreShuffles) {
  ImageParam in(Float(32), 1, "in");
  Var x("x");
  Func f("f");
  f(x) = in(2 * x) * 0.5f + in(2 * x + 1) * 0.25f;
  f.vectorize(x, 8);
  const auto code = assembly(f, avx2);
  EXPECT_EQ(count(code, "gather"), 0u);
  EXPECT_EQ(count(code, "vinsertps"), 0u);
  EXPECT_GE(count(code, "vshufps"), 2u);
}

// So does the end of a row: masked loads of all that lies between the lanes.
TEST(CodegenIdioms, StridedLoadsUnderAMaskAreShuffles) {
  for (const int stride : {2, 3, -4}) {
    ImageParam in(Float(32), 1, "in");
    Var x("x");
    Func f("f");
    f(x) = in(stride * x) * 0.5f;
    f.vectorize(x, 16, TailStrategy::GuardWithIf);
    const auto code = assembly(f, avx512);
    EXPECT_EQ(count(code, "gather"), 0u) << stride;
    EXPECT_EQ(count(code, "vinsertps"), 0u) << stride;
    EXPECT_GE(count(code, "vperm"), 1u) << stride;
  }
}

// The name of a constant that only code generation can evaluate.
TEST(CodegenIdioms, MathOfConstantsCallsNothing) {
  if (get_host_target().arch != Target::X86) GTEST_SKIP() << "the functions of x86 do not run here";
  const Type type = Float(32);
  ir::LoweredFunction f;
  f.name = "f";
  f.args = {{"out", ir::LoweredArgument::Kind::OutputBuffer, type, 1, {}}};
  const auto stores = [&](const Expr& angle) {
    const Expr lanes = ir::make_broadcast(ir::variable("angle", type), 8);
    const Stmt vector = ir::make_store("out", ir::call_op(ir::Op::sin, {lanes}),
                                       ir::make_ramp(Expr(0), Expr(1), 8));
    return ir::make_let("angle", angle, vector);
  };
  codegen::Options options;
  options.target = Target("x86-64-linux");
  f.body = stores(Expr(0.3f));
  EXPECT_EQ(codegen::compile_assembly(f, options).find("Sleef"), std::string::npos);
  f.body = stores(ir::make_load(type, "out", Expr(0)));
  expect_mentions(codegen::compile_assembly(f, options), {"Sleef"});
}

TEST(CodegenIdioms, FusedChannelsOfAnInterleavedImageAreDense) {
  ImageParam in(Float(32), 3, "in");
  Var x("x"), y("y"), c("c"), fused("fused");
  Func f("f");
  f(x, y, c) = in(x, y, c) * 0.5f;
  in.dim(0).set_stride(3).dim(2).set_stride(1).set_bounds(0, 3);
  f.output_buffer().dim(0).set_stride(3).dim(2).set_stride(1).set_bounds(0, 3);
  f.bound(c, 0, 3).reorder(c, x, y).fuse(c, x, fused).vectorize(fused, 24);
  const auto code = assembly(f, avx2);
  EXPECT_EQ(count(code, "vextractps"), 0u);
  EXPECT_EQ(count(code, "vshufps"), 0u);
  EXPECT_EQ(count(code, "gather"), 0u);
}

TEST(CodegenIdioms, AlternatingArmsAreInterleaved) {
  ImageParam a(Float(32), 1, "a"), b(Float(32), 1, "b");
  Var x("x");
  Func f("f");
  f(x) = select(x % 2 == 0, Expr(a(x / 2)), Expr(b(x / 2)));
  f.vectorize(x, 32);
  const auto code = assembly(f, avx512);
  EXPECT_EQ(count(code, "gather"), 0u);
  EXPECT_GE(count(code, "vperm") + count(code, "vunpck"), 2u);
}

// Both phases of an upsampled signal, computed together: (2 x) / 2 and (2 x + 1) / 2 are ramps for
// any range of x.
TEST(CodegenIdioms, DividedRampsAreDense) {
  ImageParam a(Float(32), 1, "a");
  Var x("x"), xi("xi");
  Func f("f");
  const Expr p = x / 2;
  f(x) = select(x % 2 == 0, a(p - 1) * 3.0f + a(p), a(p - 1) + a(p) * 5.0f);
  f.align_bounds(x, 2).split(x, x, xi, 2).reorder(xi, x).unroll(xi).vectorize(x, 16);
  const auto code = assembly(f, avx512);
  EXPECT_EQ(count(code, "gather"), 0u);
  EXPECT_GE(count(block_with_most(code, "vfmadd"), "(%r"), 2u) << "dense loads";
}

TEST(CodegenIdioms, UnrolledChannelsAreStoredTogether) {
  ImageParam a(UInt(8), 2, "a");
  Var x("x"), c("c");
  Func f("f");
  f(c, x) = a(x, c);
  f.bound(c, 0, 4).unroll(c).vectorize(x, 16);
  f.output_buffer().dim(1).set_stride(4);
  const auto code = assembly(f, avx2);
  EXPECT_EQ(count(code, "vpextrb"), 0u);
  EXPECT_GE(count(code, "vpunpck"), 4u);
}

TEST(CodegenIdioms, BlocksAreTransposedInRegisters) {
  ImageParam in(Float(32), 2, "in");
  in.dim(1).set_stride(64);
  Var x("x"), y("y"), xi("xi"), yi("yi");
  Func f("f");
  f(x, y) = in(y, x);
  f.tile(x, y, xi, yi, 8, 8).vectorize(xi).unroll(yi);
  const auto code = assembly(f, avx2);
  EXPECT_EQ(count(code, "vinsertps"), 0u);
  EXPECT_EQ(count(code, "gather"), 0u);
}

// Unpacks lanes within chunks of 16 bytes and moves such chunks, without tables of indices. Stores
// are of full registers, never of chunks.
TEST(CodegenIdioms, SquaresAreTransposedChunkByChunk) {
  for (const auto& [target, lanes] : {std::pair{avx2, 8}, std::pair{avx512, 16}}) {
    ImageParam in(Float(32), 2, "in");
    Var x("x"), y("y"), xi("xi"), yi("yi");
    Func f("f"), block("block");
    block(x, y) = in(y, x);
    f(x, y) = block(x, y);
    f.tile(x, y, xi, yi, lanes, lanes).vectorize(xi).unroll(yi);
    block.compute_at(f, x).vectorize(y, lanes).unroll(x);
    const auto code = assembly(f, target);
    EXPECT_EQ(count(code, "vunpck") % (lanes * 2), 0u) << target;
    EXPECT_GT(count(code, "vunpck"), 0u) << target;
    EXPECT_EQ(count(code, "vperm") - count(code, "vperm2f128"), 0u) << target;
    EXPECT_EQ(count(code, "vextractf"), 0u) << target;
  }
}

TEST(CodegenIdioms, AccumulatorsOfAMatrixProductStayInRegisters) {
  ImageParam a(Float(32), 2, "a"), b(Float(32), 2, "b");
  Var x("x"), y("y"), xi("xi"), yi("yi");
  RDom k(0, 64, "k");
  Func product("product"), f("f");
  product(x, y) = 0.0f;
  product(x, y) += a(k, y) * b(x, k);
  f(x, y) = product(x, y);
  f.bound(x, 0, 64).bound(y, 0, 64).tile(x, y, xi, yi, 16, 4).vectorize(xi, 8).unroll(xi);
  f.unroll(yi);
  product.compute_at(f, x).vectorize(x, 8).unroll(x).unroll(y);
  product.update().reorder(x, y, k).vectorize(x, 8).unroll(x).unroll(y);
  const auto inner = block_with_most(assembly(f, avx2), "vfmadd");
  EXPECT_EQ(count(inner, "vfmadd"), 8u);
  EXPECT_EQ(count(inner, "(%rsp"), 0u) << "a spilled accumulator";
}

// Tiles with guarded tails begin at multiples of their size, so panels of that size are read as
// vectors. The tile is one of an output with unknown strides.
TEST(CodegenIdioms, AccumulatorsOfAnUpdateStayInRegisters) {
  ImageParam in(Float(32), 3, "in"), weights(Float(32), 2, "weights");
  Var x("x"), y("y"), c("c"), xi("xi"), ci("ci");
  Func f("f");
  RDom r(0, 16, "r");
  f(x, y, c) += weights(r, c) * in(x, y, r);
  f.update()
      .tile(x, c, xi, ci, 16, 4, TailStrategy::GuardWithIf)
      .reorder(xi, ci, r, x, c, y)
      .vectorize(xi, 8)
      .unroll(xi)
      .unroll(ci);
  const auto inner = block_with_most(assembly(f, avx2), "vfmadd");
  EXPECT_GE(count(inner, "vfmadd"), 8u);
  EXPECT_EQ(count(inner, "vmovups\t%ymm"), 0u) << "a store of an accumulator";
}

TEST(CodegenIdioms, GuardedTilesReadPackedPanelsDensely) {
  ImageParam a(Float(64), 2, "a"), b(Float(64), 2, "b");
  Var x("x"), y("y"), z("z"), xi("xi"), yi("yi"), xo("xo"), yo("yo"), t("t");
  const TailStrategy tail = TailStrategy::GuardWithIf;
  RDom k(0, a.height(), "k");
  Func panels("panels"), product("product"), f("f");
  panels(x, y, z) = a(z * 8 + x, y);
  product(x, y) = 0.0;
  product(x, y) += panels(x % 8, k, x / 8) * b(k, y);
  f(x, y) = product(x, y);
  f.bound(x, 0, a.width()).bound(y, 0, b.height());
  f.tile(x, y, xi, yi, 8, 4, tail).vectorize(xi).unroll(yi);
  f.tile(x, y, xo, yo, x, y, 2, 2, tail).fuse(xo, yo, t);
  panels.compute_root().bound_extent(x, 8);
  product.compute_at(f, x).bound_extent(x, 8).bound_extent(y, 4).vectorize(x).unroll(y);
  product.update().reorder(x, y, k).vectorize(x).unroll(y);
  const auto inner = block_with_most(assembly(f, avx2), "vfmadd");
  EXPECT_GE(count(inner, "vfmadd"), 8u);
  EXPECT_EQ(count(inner, "gather") + count(inner, "vmovhpd") + count(inner, "vunpck") +
                count(inner, "vinsertf"),
            0u);
}

// A matrix product in tiles of 12 vectors, which leaves four registers for operands.
Func tiled_product(const Type& type, int lanes) {
  ImageParam a(type, 2, "a"), b(type, 2, "b");
  Var j("j"), i("i"), ji("ji"), ii("ii"), jt("jt"), it("it");
  const TailStrategy tail = TailStrategy::GuardWithIf;
  RDom k(0, a.dim(0).extent(), "k");
  Func product("product"), f("f");
  product(j, i) = cast(type, 0);
  product(j, i) += a(k, i) * b(j, k);
  f(j, i) = product(j, i);
  f.tile(j, i, ji, ii, 3 * lanes, 4, tail).vectorize(ji, lanes).unroll(ji).unroll(ii);
  f.reorder(ji, ii, i, j).parallel(j);
  product.compute_at(f, i).tile(j, i, jt, it, 3 * lanes, 4).vectorize(jt, lanes);
  product.unroll(jt).unroll(it);
  product.update().tile(j, i, jt, it, 3 * lanes, 4, tail).reorder(jt, it, k, j, i);
  product.update().vectorize(jt, lanes).unroll(jt).unroll(it);
  return f;
}

TEST(CodegenIdioms, TilesThatFillTheRegistersAreNotSpilled) {
  const auto inner = block_with_most(assembly(tiled_product(Float(64), 4), avx2), "vfmadd");
  EXPECT_EQ(count(inner, "vfmadd"), 12u);
  EXPECT_EQ(count(inner, "(%rsp"), 0u);
}

// Eight rows whose distance is known at run time only: their first addresses stay in registers, and so do all sums.
TEST(CodegenIdioms, RowsOfATileHaveAPointerEach) {
  ImageParam image(Float(32), 2, "image"), taps(Float(32), 2, "taps");
  Var lane("lane"), i("i"), j("j"), x("x"), y("y");
  Param<int> blocks("blocks");
  RDom r(0, blocks, "r");
  Func rows("rows"), f("f");
  rows(x, y) = image(x, y) + 1.0f;
  f(lane, i, j) += rows(lane + 16 * r, i) * taps(lane + 16 * r, j);
  rows.compute_root();
  f.bound(lane, 0, 16).bound(i, 0, 8).bound(j, 0, 3);
  f.update().reorder(lane, j, i, r).vectorize(lane).unroll(j).unroll(i);
  const auto inner = block_with_most(assembly(f, avx512), "vfmadd");
  EXPECT_EQ(count(inner, "vfmadd"), 24u);
  EXPECT_EQ(count(inner, "(%rsp"), 0u);
  EXPECT_LT(inner.size(), 50u) << "24 products and sums, 11 loads, and the loop";
}

// Vectors that reach past the end are accumulated in registers too, not by masked stores.
TEST(CodegenIdioms, TilesAtTheBorderStayInRegisters) {
  const auto code = assembly(tiled_product(Float(32), 8), avx2);
  const auto masked_on_stack = std::count_if(code.begin(), code.end(), [](const std::string& line) {
    return line.find("vmaskmov") != std::string::npos && line.find("(%rsp") != std::string::npos;
  });
  EXPECT_GT(count(code, "vmaskmov"), 0u);
  EXPECT_EQ(masked_on_stack, 0);
}

// The steps of an unrolled sum do not store, even if the index is not constant.
TEST(CodegenIdioms, AnUnrolledSumIsStoredOnce) {
  ImageParam in(Float(32), 1, "in"), taps(Float(32), 1, "taps");
  Var x("x"), y("y");
  RDom r(0, 7, "r");
  Func sum("sum"), f("f");
  sum(x) += in(x + r) * taps(r);
  f(x, y) = sum(x) * sum(x + y);
  sum.compute_at(f, y).update().reorder(r, x).unroll(r).vectorize(x, 8, TailStrategy::RoundUp);
  const auto inner = block_with_most(assembly(f, avx2), "vfmadd");
  EXPECT_EQ(count(inner, "vfmadd"), 7u);
  EXPECT_EQ(count(inner, "ps\t%ymm"), 0u) << "a store between the steps";
}

// A loop over the lanes that some vectors have left in memory is unrolled, and nothing goes through
// memory.
TEST(CodegenIdioms, LanesOfAnAccumulatorAreSummedInRegisters) {
  const auto check = [](const char* target, int width, int lanes) {
    ImageParam in(Float(32), 1, "in");
    Var l("l"), y("y");
    RDom blocks(0, in.width() / lanes, "blocks"), lane(0, lanes, "lane");
    Func partial("partial"), f("f");
    partial(l) += in(blocks * lanes + l);
    f(y) = sum(partial(lane));
    partial.compute_at(f, y).vectorize(l, width).unroll(l);
    partial.update().reorder(l, blocks).vectorize(l, width).unroll(l);
    const auto code = assembly(f, target);
    EXPECT_GE(count(code, "vaddss"), static_cast<size_t>(lanes - 1));
    const auto through_memory = std::count_if(code.begin(), code.end(), [](const auto& line) {
      return line.find("addss") != std::string::npos && line.find("(%rsp") != std::string::npos;
    });
    EXPECT_EQ(through_memory, 0);
  };
  check(avx2, 8, 16);
  check(avx512, 16, 64);
}

// Lanes are combined after the loop. Each iteration depends on the sum of the one before, so copies
// of the body would gain nothing.
TEST(CodegenIdioms, SumsAreCarriedAsVectors) {
  ImageParam a(Float(32), 1, "a"), b(Float(32), 1, "b");
  RDom r(0, 4096, "r");
  Func f("f");
  f() = 0.0f;
  f() += a(r) * b(r);
  f.update().atomic().vectorize(r, 8);
  const auto loop = block_with_most(assembly(f, avx2), "vfmadd");
  EXPECT_EQ(count(loop, "vfmadd"), 1u);
  EXPECT_EQ(count(loop, "vextract") + count(loop, "vhadd") + count(loop, "vaddss"), 0u);
}

TEST(CodegenIdioms, ProductsOf16BitsAreAddedInPairs) {
  ImageParam a(Int(16), 1, "a"), b(UInt(8), 1, "b");
  RDom r(0, 4096, "r");
  Func f("f");
  f() = 0;
  f() += cast<int>(a(r)) * cast<int>(b(r));
  f.update().atomic().vectorize(r, 32);
  const auto wide = block_with_most(assembly(f, avx512), "vpmaddwd");
  EXPECT_EQ(count(wide, "vpmaddwd"), 2u) << "of two iterations";
  EXPECT_EQ(count(wide, "vpmull") + count(wide, "vextract"), 0u);
  const auto narrow = block_with_most(assembly(f, avx2), "vpmaddwd");
  EXPECT_EQ(count(narrow, "vpmaddwd"), 4u) << "of two iterations";
  EXPECT_EQ(count(narrow, "vpmull"), 0u);
}

// Filter taps: one multiplication for two of them.
TEST(CodegenIdioms, TapsOf16BitsAreAddedInPairs) {
  ImageParam a(Int(16), 1, "a");
  Param<int16_t> k("k");
  Var x("x");
  Func f("f");
  const auto at = [&](int i) { return cast<int>(a(x + i)); };
  f(x) = at(0) * 13 + at(1) * cast<int>(k) + at(2) * 33 + at(3) * 14 + 5;
  f.vectorize(x, 16);
  const auto loop = block_with_most(assembly(f, avx512), "vpmaddwd");
  EXPECT_EQ(count(loop, "vpmaddwd"), 4u) << "of two iterations";
  EXPECT_EQ(count(loop, "vpmovsxwd") + count(loop, "vpmull"), 0u);
}

// The pairs are adjacent in the innermost dimension, the sums in another.
TEST(CodegenIdioms, PairsBelongToTheSumsOfSeveralLanes) {
  ImageParam a(Int(16), 2, "a"), b(Int(16), 1, "b");
  Var x("x");
  RVar ro("ro"), ri("ri");
  RDom r(0, 64, "r");
  Func f("f");
  f(x) = 0;
  f(x) += cast<int>(a(r, x)) * cast<int>(b(r));
  a.dim(1).set_stride(2);
  f.bound(x, 0, 8).vectorize(x);
  f.update().split(r, ro, ri, 2).reorder(ri, x, ro).atomic().vectorize(ri).vectorize(x);
  const auto loop = block_with_most(assembly(f, avx2), "vpmaddwd");
  EXPECT_EQ(count(loop, "vpmaddwd"), 4u) << "of four iterations";
  EXPECT_EQ(count(loop, "vpmull"), 0u);
}

TEST(CodegenIdioms, BordersOfBytesAreCompact) {
  ImageParam in(UInt(8), 1, "in");
  Var x("x");
  Func f("f"), edge = BoundaryConditions::repeat_edge(in);
  f(x) = edge(x - 1) / 2 + edge(x + 1) / 2;
  f.vectorize(x, 32);
  EXPECT_EQ(count(assembly(f, avx2), "vpinsrb"), 0u);
}

// Clamped coordinates lie within one vector of memory, wherever the border is.
TEST(CodegenIdioms, HeldCoordinatesAreLoadedDensely) {
  const auto code_for = [](Type type, int lanes, const std::string& target) {
    ImageParam in(type, 1, "in");
    Var x("x");
    Func f("f");
    f(x) = in(clamp(x - 3, 0, in.width() - 1));
    f.vectorize(x, lanes, TailStrategy::RoundUp);
    return assembly(f, target);
  };
  const std::string cannonlake = std::string(avx512) + "-avx512_cannonlake";
  EXPECT_GE(count(code_for(UInt(8), 64, cannonlake), "vpermb"), 1u);
  EXPECT_EQ(count(code_for(UInt(8), 64, cannonlake), "vpinsrb"), 0u);
  EXPECT_GE(count(code_for(Int(16), 32, avx512), "vpermw"), 1u);
  EXPECT_GE(count(code_for(Float(32), 16, avx512), "vpermd"), 1u);
  EXPECT_EQ(count(code_for(Float(32), 16, avx512), "gather"), 0u);
  EXPECT_GE(count(code_for(Float(32), 8, avx2), "vpermd"), 1u);
  EXPECT_GE(
      count(code_for(UInt(8), 32, avx2), "vmovups") + count(code_for(UInt(8), 32, avx2), "vmovdqu"),
      1u)
      << "where no lane is held";
}

// The value that a scan computed in the previous iteration is not reloaded from memory.
TEST(CodegenIdioms, ScansCarryTheirLastValueInARegister) {
  ImageParam in(Float(32), 1, "in");
  RDom t(1, 99, "t");
  Var x("x"), y("y");
  Func scan("scan"), f("f");
  scan(x, y) = 0.0f;
  scan(x, t) = scan(x, t - 1) * scan(x, t - 1) + in(x);
  f(x) = scan(x, 99) + scan(x, 50);
  scan.compute_at(f, x).vectorize(x, 8).update().reorder(x, t).vectorize(x, 8);
  f.vectorize(x, 8);
  const auto loop = block_with_most(assembly(f, avx2), "vfmadd");
  EXPECT_EQ(count(loop, "vfmadd"), 1u);
  EXPECT_EQ(count(loop, "(%r"), 0u) << "nothing is loaded before the step";
}

// Only the last vector of a reduction in lanes is masked.
TEST(CodegenIdioms, FactoredReductionsAreMaskedOnlyAtTheirEnd) {
  ImageParam in(Float(32), 1, "in");
  RDom r(0, in.dim(0).extent(), "r");
  RVar ro("ro"), ri("ri");
  Var lane("lane");
  Func f("f");
  f() = 0.0f;
  f() += in(r)*in(r);
  Func lanes = f.update().split(r, ro, ri, 8).rfactor(ri, lane);
  lanes.compute_root().vectorize(lane, 8).update().reorder(lane, ro).vectorize(lane, 8);
  const auto loop = block_with_most(assembly(f, avx2), "vfmadd");
  EXPECT_EQ(count(loop, "vmaskmov"), 0u);
  EXPECT_EQ(count(loop, "vfmadd"), 1u);
  EXPECT_EQ(count(loop, "(%r"), 1u) << "a load of the input";
}

// A small reduction loop inside a vector loop is fully unrolled.
TEST(CodegenIdioms, ReductionsOverAFewElementsAreUnrolled) {
  ImageParam in(UInt(8), 2, "in");
  RDom r(-2, 5, -2, 5, "r");
  Var x("x"), y("y");
  Func f("f");
  f(x, y) = minimum(in(x + r.x, y + r.y));
  f.vectorize(x, 32);
  EXPECT_GE(count(block_with_most(assembly(f, avx2), "vpminub"), "vpminub"), 24u);
}

// A loop over at most three elements in an image of unknown extent.
TEST(CodegenIdioms, LoopsOfFewIterationsAreNotUnrolled) {
  const auto adds = [](int most) {
    ImageParam in(Int(32), 2, "in");
    Var x("x"), y("y");
    RDom r(0, clamp(in.height(), 0, most), "r");
    Func f("f");
    f(x) += in(x, r) ^ 5;
    f.vectorize(x, 8, TailStrategy::RoundUp);
    f.update().reorder(r, x).vectorize(x, 8, TailStrategy::RoundUp);
    return count(block_with_most(assembly(f, avx2), "vpaddd"), "vpaddd");
  };
  EXPECT_EQ(adds(3), 1u);
  EXPECT_GE(adds(1000), 2u);
}

TEST(CodegenIdioms, ShortVectorLoopsAreUnrolled) {
  ImageParam in(UInt(16), 1, "in");
  Var x("x");
  Func f("f");
  f(x) = in(x) + in(x + 1);
  f.vectorize(x, 16, TailStrategy::RoundUp);
  EXPECT_EQ(count(block_with_most(assembly(f, avx2), "vpaddw"), "vpaddw"), 4u);
}

// The last vector of a row is moved back into it, so pointers do not advance by a constant. Row and
// buffer offsets must still be added before the loop.
TEST(CodegenIdioms, MovedVectorsAddNothingToTheirPointers) {
  ImageParam in(Float(32), 2, "in");
  Var x("x"), y("y");
  Func f("f");
  Expr sum = 0.0f;
  for (int row = 0; row < 5; row++)
    sum += in(x, y + row) * in(x + 1, y + row) - sqrt(in(x + 2, y + row));
  f(x, y) = sum;
  f.vectorize(x, 8, TailStrategy::ShiftInwards);
  const auto body = block_with_most(assembly(f, avx2), "ymm");
  EXPECT_EQ(count(body, "cmovl") + count(body, "cmovg"), 1u) << "the move, or this tests nothing";
  EXPECT_LE(count(body, "\tadd") + count(body, "\tsub") + count(body, "\tlea"), 3u);
}

// LLVM's scheduler takes time quadratic in the accesses of a block. Fences, which emit no
// instructions, split the block.
TEST(CodegenIdioms, LongStraightCodeIsFenced) {
  const auto fences_of = [](int statements) {
    ImageParam in(Float(32), 1, "in");
    Var x("x");
    Func f("f");
    std::vector<Expr> values;
    for (int i = 0; i < statements; ++i) values.push_back(in(i * 37 % statements) * 2.0f);
    f(x) = mux(x, values);
    f.bound(x, 0, statements).unroll(x);
    const auto code = assembly(f, avx2);
    EXPECT_EQ(count(code, "mfence"), 0u);
    return count(code, "MEMBARRIER");
  };
  EXPECT_EQ(fences_of(200), 0u);
  EXPECT_EQ(fences_of(400), 6u) << "one after each 64 stores";
}

// Pieces of one function that threads compile concurrently, with 16 numbers each.
TEST(CodegenIdioms, SaturatingCastsOfVectorsAreVectors) {
  for (const Type from : {Float(32), Float(64)}) {
    for (const Type to : {UInt(8), Int(8), UInt(16), Int(16), Int(32)}) {
      ImageParam in(from, 1, "in");
      Var x("x");
      Func f("f");
      f(x) = saturating_cast(to, in(x));
      f.vectorize(x, 16);
      for (const char* target : {avx2, avx512}) {
        const auto code = assembly(f, target);
        EXPECT_EQ(count(code, "vcvttss2si") + count(code, "vcvttsd2si"), 0u) << from << to;
        EXPECT_GE(count(code, "vcvttp"), 1u) << from << to;
      }
    }
  }
}

// A tile beyond the end computes nothing; the others begin at a multiple of 16, so data packed by
// 16 is read densely.
TEST(CodegenIdioms, PackedReadsUnderAGuardAreDense) {
  ImageParam in(Float(32), 2, "in"), other(Float(32), 2, "other");
  Var x("x"), y("y"), k("k"), xo("xo"), yo("yo");
  Func packed("packed"), sum("sum"), out("out");
  RDom r(0, 64, "r");
  packed(x, k, xo) = in(xo * 16 + x, k);
  sum(x, y) += packed(x % 16, r, x / 16) * other(r, y);
  out(x, y) = sum(x, y) * 2.0f;
  out.tile(x, y, xo, yo, x, y, 32, 8, TailStrategy::GuardWithIf);
  Var xi("xi"), yi("yi");
  out.tile(x, y, xi, yi, 16, 4);
  out.bound(x, 0, in.width()).fuse(xo, yo, xo).parallel(xo);
  packed.compute_root();
  sum.compute_at(out, x).bound_extent(x, 16).bound_extent(y, 4).vectorize(x).unroll(y);
  sum.update().reorder(x, y, r).vectorize(x).unroll(y);
  const auto code = assembly(out, avx512);
  EXPECT_EQ(count(code, "gather"), 0u);
}

// LLVM's code generator takes quadratic time for a block with many long-lived values.
TEST(CodegenIdioms, NoBlockGrowsWithTheStatementsOfAProgram) {
  ImageParam in(Float(32), 1, "in");
  Var x("x");
  Func f("f");
  std::vector<Expr> values{in(x)};
  for (int i = 0; i < 3000; i++) values.push_back(values.back() * (0.5f + 0.0001f * i) + in(x + i));
  Expr all = 0.0f;  // the last value first
  for (auto value = values.rbegin(); value != values.rend(); ++value) all = *value - all * 0.25f;
  f(x) = all;
  f.vectorize(x, 8);
  size_t longest = 0, length = 0;
  for (const std::string& line : assembly(f, avx2)) {
    const bool is_label = !line.empty() && line[0] != '\t' && line[0] != ' ' && line[0] != '#';
    length = is_label ? 0 : length + 1;
    longest = std::max(longest, length);
  }
  EXPECT_LT(longest, 6000u);
}

TEST(CodegenIdioms, LongFunctionsAreCutBetweenTheirLoops) {
  ImageParam in(Float(32), 2, "in");
  Var x("x"), y("y"), yi("yi");
  std::vector<Func> stages;
  for (int i = 0; i < 4; i++) {
    const auto source = [&](Expr at) -> Expr { return i == 0 ? in(at, y) : stages.back()(at, y); };
    Func stage("stage" + std::to_string(i));
    Expr sum = 0.0f;
    for (int tap = 0; tap < 24; tap++) sum += source(x + tap) * (1.0f + tap * tap);
    stage(x, y) = sum;
    stages.push_back(stage);
  }
  for (Func& stage : stages) stage.vectorize(x, 8);
  stages.back().split(y, y, yi, 16).parallel(y);
  for (size_t i = 0; i + 1 < stages.size(); i++) stages[i].compute_at(stages.back(), y);
  const auto code = assembly(stages.back(), avx2);
  EXPECT_GE(count(code, ".loop0:"), 1u);
}

// A call and its setup would take half the time of loops that may run only once.
TEST(CodegenIdioms, LoopsOfUnknownLengthInsideOfOthersAreNotCut) {
  ImageParam in(Float(32), 3, "in"), filter(Float(32), 3, "filter");
  Var c("c"), x("x"), xi("xi");
  RDom k(0, 3, 0, 3, "k");
  Func f("f"), sums[2];
  for (Func& sum : sums) {
    sum(c, x) += filter(c, k.x, k.y) * in(c, x + k.x, k.y);
    sum.compute_at(f, x).vectorize(c, 8, TailStrategy::RoundUp);
    sum.update().reorder(k.x, k.y, c, x).unroll(k.x).unroll(k.y);
    sum.update().vectorize(c, 8, TailStrategy::RoundUp);
  }
  RDom channels(0, filter.width(), "channels");
  f(x) += sums[0](channels, x) * sums[1](channels, x);
  f.update().split(x, x, xi, 4).reorder(channels, xi, x).parallel(x);
  for (Func& sum : sums) sum.compute_at(f, x);
  EXPECT_EQ(count(assembly(f, avx2), ".loop0:"), 0u);
}

// The sums stay in registers while r runs, so its loops remain in one function with their
// initialisation and final stores.
TEST(CodegenIdioms, LoopsThatShareRegistersStayInOneFunction) {
  ImageParam in(Float(32), 2, "in");
  Var x("x"), xo("xo");
  RDom r(0, 512, "r");
  Func f("f"), sums[2];
  for (Func& sum : sums) {
    Expr terms = 0.0f;
    for (int tap = 0; tap < 60; tap++) terms += in(x + tap, r) * (1.0f + tap * tap);
    sum(x) += terms;
    sum.compute_at(f, xo).vectorize(x, 8).update().reorder(x, r).vectorize(x, 8);
  }
  f(x) = sums[0](x) * sums[1](x);
  f.split(x, xo, x, 8).vectorize(x);
  EXPECT_EQ(count(assembly(f, avx2), ".loop0:"), 0u);
}

// However often unrolled code uses them: twenty accumulators, each at two steps of k.
TEST(CodegenIdioms, LoopsOverLargeTilesStayBesideTheirAccumulators) {
  ImageParam a(Float(32), 2, "a"), b(Float(32), 2, "b");
  Var j("j"), i("i"), ji("ji"), ii("ii");
  RDom k(0, 512, "k");
  Func product("product"), f("f");
  product(j, i) += a(k, i) * b(j, k);
  f(j, i) = max(product(j, i), 0.0f);
  f.bound(j, 0, 512).bound(i, 0, 500).tile(j, i, ji, ii, 64, 5);
  f.vectorize(ji, 16).unroll(ji).unroll(ii).parallel(i);
  product.compute_at(f, j).vectorize(j, 16).unroll(j).unroll(i);
  product.update().reorder(j, i, k).vectorize(j, 16).unroll(j).unroll(i).unroll(k, 2);
  const auto code = assembly(f, avx512);
  EXPECT_EQ(count(code, ".loop0:"), 0u);
  const auto inner = block_with_most(code, "vfmadd");
  EXPECT_EQ(count(inner, "vfmadd"), 40u);
  EXPECT_EQ(count(inner, "vmovups\t%zmm") + count(inner, "vmovaps\t%zmm"), 0u) << "a store";
}

// Memory that each iteration of such a loop initialises moves with it, and may become registers.
TEST(CodegenIdioms, LoopsThatAreCutTakeTheirMemoryAlong) {
  ImageParam in(Float(32), 2, "in");
  Var x("x"), xo("xo"), y("y"), yi("yi");
  RDom r(0, 32, "r");
  Func f("f"), sums[2], stages[2];
  for (int i = 0; i < 2; i++) {
    Expr terms = 0.0f;
    for (int tap = 0; tap < 60; tap++) terms += in(x + tap, y + r) * (1.0f + tap * tap);
    sums[i](x, y) += terms;
    stages[i](x, y) = sums[i](x, y);
    stages[i].compute_at(f, y).split(x, xo, x, 8).vectorize(x);
    sums[i].compute_at(stages[i], xo).vectorize(x, 8);
    sums[i].update().reorder(x, y, r).vectorize(x, 8);
  }
  f(x, y) = stages[0](x, y) * stages[1](x, y);
  f.split(y, y, yi, 16).parallel(y);
  const auto code = assembly(f, avx2);
  const auto begin = std::find_if(code.begin(), code.end(), [](const std::string& line) {
    return !line.empty() && line[0] != '\t' && line.find(".loop0:") != std::string::npos;
  });
  ASSERT_NE(begin, code.end());
  const auto end = std::find_if(begin, code.end(), [](const std::string& line) {
    return line.find(".Lfunc_end") != std::string::npos;
  });
  EXPECT_EQ(count({begin, end}, "vmovups\t%ymm"), 1u) << "the stage, and not the sum";
}

}  // namespace
}  // namespace retrograde
