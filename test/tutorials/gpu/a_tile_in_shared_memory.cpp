// A blur on a GPU: blocks, threads, a tile in shared memory; where buffers are; what the device would have
// to do.
//
// No GPU is wanted: RETROGRADE_GPU=simulated in the environment, which main() sets first, makes kernels run
// on the simulated device, which finds races and counts accesses. Without it they run on the machine's GPU.
#include <retrograde/retrograde.h>

#include <cstdlib>

#include "../gradients/tutorial.h"
#include "simt/simt_driver.h"

using namespace retrograde;

namespace {

const int width = 256, height = 64;

// The sum of five neighbours in a row, of five rows.
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

// Sectors of 32 bytes that the warps of all kernels since the last question asked of device memory.
double sectors_asked() {
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
  options.profile = 1;  // counts; slower
  retrograde_simt_set_options(&options);

  Buffer<float> in(width, height);
  in.for_each_element([&](int x, int y) { in(x, y) = static_cast<float>((x * 5 + y * 3) % 16); });
  Buffer<float> expected = Blur(in).out.realize({width, height});

  // ---- A target with a GPU; a schedule with blocks and threads. ----
  const Target target =
      get_host_target().with_feature(Target::CUDA).with_feature(Target::CUDACapability80);
  Blur points(in);
  points.out.gpu_tile(points.x, points.y, points.xi, points.yi, 32, 8);
  Buffer<float> result = points.out.realize({width, height}, target);
  claim(same(result, expected), "a thread for each point gives the bits that the CPU gives");
  const double by_points = sectors_asked();

  // ---- What 32 x 8 threads need of `rows` is 32 x 12 points: computed once, by all of them. ----
  Blur tiles(in);
  tiles.out.gpu_tile(tiles.x, tiles.y, tiles.xi, tiles.yi, 32, 8);
  tiles.rows.compute_at(tiles.out, tiles.x).gpu_threads(tiles.x, tiles.y);
  result = tiles.out.realize({width, height}, target);
  claim(same(result, expected), "so does a tile of rows in shared memory");
  const double by_rows = sectors_asked();
  claim(by_rows < by_points / 2, "it asks for less than half of the memory");

  // ---- And the image once for each block. ----
  Blur staged(in);
  staged.out.gpu_tile(staged.x, staged.y, staged.xi, staged.yi, 32, 8);
  staged.rows.compute_at(staged.out, staged.x).gpu_threads(staged.x, staged.y);
  staged.image.compute_at(staged.out, staged.x).gpu_threads(staged.x, staged.y);
  result = staged.out.realize({width, height}, target);
  claim(same(result, expected), "so does a tile of the image beside it");
  const double by_tiles = sectors_asked();
  claim(by_tiles < by_rows, "which asks for less again");

  // ---- Threads run in any order; the simulated device tries some, and finds what races. ----
  for (const int order :
       {retrograde_simt_reverse, retrograde_simt_random, retrograde_simt_warp_ahead}) {
    retrograde_simt_get_options(&options);
    options.order = order;
    retrograde_simt_set_options(&options);
    result = staged.out.realize({width, height}, target);
    claim(same(result, expected), "another order of threads changes nothing");
  }

  // ---- Results that are given a Buffer stay on the device, and are inputs without a copy. ----
  Buffer<float> once(width, height), twice(width, height);
  Blur second(once);
  second.out.gpu_tile(second.x, second.y, second.xi, second.yi, 32, 8);
  staged.out.realize(once, target);
  second.out.realize(twice, target);
  claim(once.device_dirty(), "the newest elements are the device's");
  const int64_t copies = retrograde_simt_call_count("cuMemcpyHtoDAsync_v2") +
                         retrograde_simt_call_count("cuMemcpyDtoHAsync_v2");
  staged.out.realize(once, target);
  second.out.realize(twice, target);
  claim(retrograde_simt_call_count("cuMemcpyHtoDAsync_v2") +
                retrograde_simt_call_count("cuMemcpyDtoHAsync_v2") ==
            copies,
        "run again, two blurs in a row copy nothing");
  once.copy_to_host();
  claim(same(once, expected), "copy_to_host brings the result");

  // ---- What no GPU can run is said before anything runs. ----
  Blur wrong(in);
  wrong.out.gpu_tile(wrong.x, wrong.y, wrong.xi, wrong.yi, 64, 32);
  try {
    wrong.out.compile_jit(target);
    claim(false, "2,048 threads in a block are refused");
  } catch (const CompileError& error) {
    claim(std::string(error.what()).find("1,024") != std::string::npos ||
              std::string(error.what()).find("1024") != std::string::npos,
          "2,048 threads in a block are refused, and the error says how many there can be");
  }

  Picture picture("Sectors of device memory that a blur asks for: by points, by rows, by tiles");
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
