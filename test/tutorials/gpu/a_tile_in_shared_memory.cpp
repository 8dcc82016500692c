// A blur on a GPU: blocks, threads, a tile in shared memory, copies of buffers, memory traffic.
//
// The program needs no GPU: main() sets RETROGRADE_GPU=simulated in the environment, so that kernels run on the
// simulated device, which finds races and counts accesses. Without the variable they run on the machine's GPU.
#include <retrograde/retrograde.h>

#include <cstdlib>

#include "../gradients/tutorial.h"
#include "simt/simt_driver.h"

using namespace retrograde;

namespace {

const int width = 256, height = 64;

// The mean of 5 x 5 neighbours: sums along rows, then along columns.
struct Blur {
  Var x{"x"}, y{"y"}, xi{"xi"}, yi{"yi"};
  Func image{"image"}, rows{"rows"}, out{"out"};
  explicit Blur(const Buffer<float>& in) {
    image(x, y) = BoundaryConditions::repeat_edge(in)(x, y);
    rows(x, y) =
        image(x - 2, y) + image(x - 1, y) + image(x, y) + image(x + 1, y) + image(x + 2, y);
    out(x, y) =
        (rows(x, y - 2) + rows(x, y - 1) + rows(x, y) + rows(x, y + 1) + rows(x, y + 2)) / 25;
  }
};

// 32-byte sectors of device memory that warps have accessed since the last call.
double sectors_accessed() {
  retrograde_simt_profile counted = {};
  retrograde_simt_get_profile(nullptr, &counted);
  retrograde_simt_reset_profile();
  return static_cast<double>(counted.global_sectors);
}

bool same(const Buffer<float>& a, const Buffer<float>& b) {
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i)
      if (a(i, j) != b(i, j)) return false;
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  setenv("RETROGRADE_GPU", "simulated", 1);
  retrograde_simt_options options;
  retrograde_simt_get_options(&options);
  options.profile = 1;  // counts accesses, which is slower
  retrograde_simt_set_options(&options);

  Buffer<float> in(width, height);
  in.for_each_element([&](int x, int y) { in(x, y) = static_cast<float>((x * 5 + y * 3) % 16); });
  Buffer<float> expected = Blur(in).out.realize({width, height});

  // ---- A target with a GPU, and a schedule with blocks and threads. ----
  const Target target =
      get_host_target().with_feature(Target::CUDA).with_feature(Target::CUDACapability80);
  Blur points(in);
  points.out.gpu_tile(points.x, points.y, points.xi, points.yi, 32, 8);
  Buffer<float> result = points.out.realize({width, height}, target);
  claim(same(result, expected), "one thread per point gives the same bits as the CPU");
  const double by_points = sectors_accessed();

  // ---- A block of 32 x 8 threads reads 32 x 12 points of `rows`. Its threads compute them once, together. ----
  Blur tiles(in);
  tiles.out.gpu_tile(tiles.x, tiles.y, tiles.xi, tiles.yi, 32, 8);
  tiles.rows.compute_at(tiles.out, tiles.x).gpu_threads(tiles.x, tiles.y);
  result = tiles.out.realize({width, height}, target);
  claim(same(result, expected), "a tile of rows in shared memory gives the same bits");
  const double by_rows = sectors_accessed();
  claim(by_rows < by_points / 2, "it accesses less than half as many sectors");

  // ---- The image, too, is loaded once per block. ----
  Blur staged(in);
  staged.out.gpu_tile(staged.x, staged.y, staged.xi, staged.yi, 32, 8);
  staged.rows.compute_at(staged.out, staged.x).gpu_threads(staged.x, staged.y);
  staged.image.compute_at(staged.out, staged.x).gpu_threads(staged.x, staged.y);
  result = staged.out.realize({width, height}, target);
  claim(same(result, expected), "a second tile, of the image, gives the same bits");
  const double by_tiles = sectors_accessed();
  claim(by_tiles < by_rows, "it accesses fewer sectors still");

  // ---- Threads may run in any order. The simulated device offers several, and reports races. ----
  for (const int order :
       {retrograde_simt_reverse, retrograde_simt_random, retrograde_simt_warp_ahead}) {
    retrograde_simt_get_options(&options);
    options.order = order;
    retrograde_simt_set_options(&options);
    result = staged.out.realize({width, height}, target);
    claim(same(result, expected), "another order of threads changes nothing");
  }

  // ---- A Buffer passed to realize() stays on the device, and is an input of the next call without a copy. ----
  Buffer<float> once(width, height), twice(width, height);
  Blur second(once);
  second.out.gpu_tile(second.x, second.y, second.xi, second.yi, 32, 8);
  staged.out.realize(once, target);
  second.out.realize(twice, target);
  claim(once.device_dirty(), "the current elements are on the device");
  const int64_t copies = retrograde_simt_call_count("cuMemcpyHtoDAsync_v2") +
                         retrograde_simt_call_count("cuMemcpyDtoHAsync_v2");
  staged.out.realize(once, target);
  second.out.realize(twice, target);
  claim(retrograde_simt_call_count("cuMemcpyHtoDAsync_v2") +
                retrograde_simt_call_count("cuMemcpyDtoHAsync_v2") ==
            copies,
        "a second run of both blurs copies nothing");
  once.copy_to_host();
  claim(same(once, expected), "copy_to_host copies the result to the host");

  // ---- Schedules that no GPU can run are rejected at compile time. ----
  Blur wrong(in);
  wrong.out.gpu_tile(wrong.x, wrong.y, wrong.xi, wrong.yi, 64, 32);
  try {
    wrong.out.compile_jit(target);
    claim(false, "2,048 threads in a block are rejected");
  } catch (const CompileError& error) {
    claim(std::string(error.what()).find("1,024") != std::string::npos ||
              std::string(error.what()).find("1024") != std::string::npos,
          "2,048 threads in a block are rejected, and the error states the maximum");
  }

  Picture picture("32-byte sectors that a blur accesses, for three schedules");
  const double most = by_points;
  picture.cells(40, 60, 60, {{by_points / most}}, 0, 1);
  picture.cells(180, 60, 60, {{by_rows / most}}, 0, 1);
  picture.cells(320, 60, 60, {{by_tiles / most}}, 0, 1);
  const auto count = [](double n) { return std::to_string(static_cast<int64_t>(n)); };
  picture.text(40, 140, "points: " + count(by_points));
  picture.text(180, 140, "rows: " + count(by_rows));
  picture.text(320, 140, "tiles: " + count(by_tiles));
  picture.write(argc, argv, "a_tile_in_shared_memory");
}
