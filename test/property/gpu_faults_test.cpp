// The simulated device finds faults in kernels that a lowering with a bug would generate.
//
// Each test breaks a kernel: it removes a barrier, narrows it from the block to a warp, overlaps arrays of shared
// memory, or drops a condition. Some faults are harmless, such as a missing barrier between accesses that do not
// conflict. A fault is real if some order of threads gives a different result. Each real fault must be found in the
// first run that checks for races, in any order.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <map>

#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "jit/jit.h"
#include "simt/simt_driver.h"
#include "support/simulated_device.h"

namespace retrograde {
namespace {

constexpr int width = 37, height = 21;

// ---- programs ----

struct Made {
  ImageParam in{Float(32), 2, "in"};
  Func out{"out"};
  Var x{"x"}, y{"y"}, xi{"xi"}, yi{"yi"}, u{"u"};

  // The seed determines the tile sizes.
  explicit Made(int seed) {
    const int tile_x = 4 + seed * 3 % 13, tile_y = 2 + seed * 5 % 7;
    if (seed % 4 == 0) two_stages(tile_x, tile_y);
    if (seed % 4 == 1) product(tile_y);
    if (seed % 4 == 2) in_turns(tile_x);
    if (seed % 4 == 3) in_warps(tile_y);
  }

  void two_stages(int tile_x, int tile_y) {
    Func rows("rows"), columns("columns");
    rows(x, y) = in(x, y) + 2.0f * in(x + 1, y);
    columns(x, y) = rows(x, y) + 3.0f * rows(x, y + 1);
    out(x, y) = columns(x, y) * columns(x + 1, y + 1);
    out.gpu_tile(x, y, xi, yi, tile_x, tile_y, TailStrategy::GuardWithIf);
    columns.compute_at(out, x).gpu_threads(x, y);
    rows.compute_at(out, x).gpu_threads(x, y);
  }

  void product(int tile) {
    RDom r(0, 16, "r");
    RVar ro("ro"), ri("ri");
    Func sum("sum"), left("left"), right("right");
    left(x, y) = in(x, y);
    right(x, y) = in(y, x);
    sum(x, y) = 0.0f;
    sum(x, y) += left(r, y) * right(x, r);
    out(x, y) = sum(x, y);
    out.gpu_tile(x, y, xi, yi, tile, tile, TailStrategy::GuardWithIf);
    sum.compute_at(out, x).store_in(MemoryType::GPUShared).gpu_threads(x, y);
    sum.update().split(r, ro, ri, 4).reorder(ri, x, y, ro).gpu_threads(x, y);
    left.compute_at(sum, ro).gpu_threads(x, y);
    right.compute_at(sum, ro).gpu_threads(x, y);
  }

  void in_turns(int tile) {
    Func line("line");
    line(x, y) = in(x, y) * 2.0f;
    out(x, y) = line(x, y) + line(x + 3, y) + line(x + 1, y);
    out.gpu_tile(x, y, xi, yi, tile, 1, TailStrategy::GuardWithIf);
    line.compute_at(out, x).split(x, x, u, 3, TailStrategy::GuardWithIf).gpu_threads(u);
  }

  // Each warp mirrors its own row; then all of them read the mirrored column.
  void in_warps(int tile_y) {
    constexpr int warp = 32;
    Func line("line"), turned("turned");
    line(x, y) = in(x, y) * 2.0f;
    turned(x, y) = line(x / warp * warp + (warp - 1 - x % warp), y) - line(x, y);
    out(x, y) = turned(x, y) + turned(x, y / tile_y * tile_y + (tile_y - 1 - y % tile_y));
    out.output_buffer().dim(0).set_min(0);
    out.output_buffer().dim(1).set_min(0);
    out.gpu_tile(x, y, xi, yi, warp, tile_y, TailStrategy::GuardWithIf);
    line.compute_at(out, x).gpu_threads(x, y);
    turned.compute_at(out, x).gpu_threads(x, y);
  }
};

// ---- faults ----

bool is_barrier(const Stmt& s, ir::Op op) {
  const auto* call = s.as<ir::Evaluate>();
  return call && ir::as_op(call->value, op);
}

// Whether the statement tests the iteration or the thread.
bool is_guard(const Stmt& s) {
  const auto* choice = s.as<ir::IfThenElse>();
  return choice && !choice->when_false.defined() &&
         ir::any_node(choice->condition, [](const ir::Variable& v) {
           return v.name.find("thread.") != std::string::npos ||
                  v.name.find("block.") != std::string::npos;
         });
}

bool is_shared(const Stmt& s) {
  const auto* n = s.as<ir::Allocate>();
  return n && n->memory == MemoryType::GPUShared && ir::as_const_int(n->offset).value_or(0) > 0;
}

// Inserts the fault with this number, counted over the function.
class FaultMaker : public ir::Rewriter {
 public:
  explicit FaultMaker(int wanted) : wanted_(wanted) {}
  std::string fault, kind;

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (s.kind() == ir::Kind::Launch) {
      in_kernel_ = true;
      Stmt result = children(s);
      in_kernel_ = false;
      return result;
    }
    const bool is_of_block = is_barrier(s, ir::Op::gpu_barrier),
               is_of_warp = is_barrier(s, ir::Op::gpu_warp_barrier);
    if (!in_kernel_ || !(is_of_block || is_of_warp || is_guard(s) || is_shared(s)))
      return children(s);
    if (is_of_block && number_++ == wanted_) {
      fault = kind = "weaker barrier";
      return ir::make_evaluate(ir::call_op(ir::Op::gpu_warp_barrier, Int(32), {}));
    }
    if (number_++ != wanted_) return children(s);
    if (is_of_block || is_of_warp) {
      fault = kind = is_of_block ? "barrier" : "barrier of warps";
      return ir::make_evaluate(0);
    }
    if (const auto* choice = s.as<ir::IfThenElse>()) {
      kind = "condition";
      fault = ir::print(choice->condition);
      return choice->when_true;
    }
    const auto& n = *s.as<ir::Allocate>();
    kind = "overlap";
    fault = n.name;
    return ir::make_allocate(n.name, n.type, n.memory, n.elements, n.body, 0);
  }
  Expr rewrite(const Expr& e) override { return e; }

 private:
  const int wanted_;
  int number_ = 0;
  bool in_kernel_ = false;
};

// ---- runs ----

struct Result {
  int code = 0;
  std::vector<float> values;
  bool operator==(const Result&) const = default;
};

void choose(int order, uint64_t seed, bool find_races) {
  retrograde_simt_options options;
  retrograde_simt_get_options(&options);
  options.order = order;
  options.seed = seed;
  options.find_races = find_races;
  retrograde_simt_set_options(&options);
}

Result run(const ir::LoweredFunction& function, int order, bool find_races = true,
           uint64_t seed = 0) {
  choose(order, seed, find_races);
  Buffer<float> in(width + 40, height + 40), out(width, height);
  in.for_each_element(
      [&](int x, int y) { in(x, y) = static_cast<float>((x * 7 + y * 31) % 64 + 1); });
  out.fill(-1);
  std::vector<void*> args = {in.raw_buffer(), out.raw_buffer()};
  Result result;
  const auto code = jit::compile(function, with_gpu());
  result.code = code->call(nullptr, args.data());
  if (result.code == 0) {
    try {
      out.copy_to_host();
      result.values.assign(out.begin(), out.end());
    } catch (const RuntimeError&) {
      result.code = 1;
    }
  }
  in.device_deallocate();
  out.device_deallocate();
  // A device remains usable after a failure.
  const auto* device = get_device_interface_for_device_api(DeviceAPI::CUDA);
  if (result.code != 0) device->device_release(nullptr, device);
  return result;
}

bool is_real(const ir::LoweredFunction& wrong, const Result& expected) {
  constexpr uint64_t random_orders = 8;
  for (const int order :
       {retrograde_simt_forward, retrograde_simt_reverse, retrograde_simt_warp_ahead}) {
    if (!(run(wrong, order, false) == expected)) return true;
  }
  for (uint64_t seed = 1; seed <= random_orders; ++seed) {
    if (!(run(wrong, retrograde_simt_random, false, seed) == expected)) return true;
  }
  return false;
}

TEST(GpuFaults, AreFound) {
  constexpr int wanted = 200;
  std::map<std::string, int> kinds;
  int faults = 0, harmless = 0;
  for (int seed = 0; faults < wanted; ++seed) {
    Made made(seed);
    const Module module = made.out.compile_to_module({made.in}, "out", with_gpu());
    const ir::LoweredFunction right = module.functions()[0].lowered;
    const int order = seed % 4;
    const Result expected = run(right, order);
    ASSERT_EQ(expected.code, 0) << "without a fault, seed " << seed;
    for (int number = 0; faults < wanted; ++number) {
      FaultMaker maker(number);
      ir::LoweredFunction wrong = right;
      wrong.body = maker(right.body);
      if (maker.fault.empty()) break;
      if (!is_real(wrong, expected)) {
        ++harmless;
        continue;
      }
      ++faults;
      ++kinds[maker.kind];
      EXPECT_FALSE(run(wrong, order) == expected)
          << "seed " << seed << ", not found: " << maker.kind << " " << maker.fault;
    }
  }
  choose(retrograde_simt_forward, 0, true);
  for (const char* kind : {"barrier", "weaker barrier", "overlap", "condition"})
    EXPECT_GE(kinds[kind], 20) << kind;
  EXPECT_GE(kinds["barrier of warps"], 10);
  EXPECT_LT(harmless, 2 * faults) << "few of the faults are any";
}

}  // namespace
}  // namespace retrograde
