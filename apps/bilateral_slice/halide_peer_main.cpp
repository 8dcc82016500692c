// halide_peer_main.cpp -- the same optimization in Halide 14, with Halide's gradients and its Li2018 schedule.
//
// It is a separate program, so that bilateral_slice does not need Halide, and the two compilers share neither memory
// nor crashes. bilateral_slice starts it; see peer_protocol.h.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <vector>

#include "peer_protocol.h"
#include "trainer.h"

namespace bilateral_slice {

namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

template <typename T>
bool receive(T* values, size_t count) {
  return std::fread(values, sizeof(T), count, stdin) == count;
}

// Results go to the original standard output, to which nothing that Halide prints can go any more.
std::FILE* open_answers() {
  std::FILE* answers = ::fdopen(::dup(STDOUT_FILENO), "wb");
  ::dup2(STDERR_FILENO, STDOUT_FILENO);
  return answers;
}

template <typename T>
void answer(std::FILE* out, const T& value) {
  std::fwrite(&value, sizeof(T), 1, out);
  std::fflush(out);
}

PeerStep timed_step(Trainer& trainer, float rate) {
  const auto start = std::chrono::steady_clock::now();
  const double loss = trainer.step(rate);
  return {loss, seconds_since(start)};
}

int serve() {
  std::FILE* answers = open_answers();
  PeerJob job;
  if (!answers || !receive(&job, 1)) return 2;
  const Shape shape{.width = job.width,
                    .height = job.height,
                    .grid_x = job.grid_x,
                    .grid_y = job.grid_y,
                    .channels = job.channels};
  std::vector<float> photo(shape.samples() + shape.pixels()), target(shape.samples());
  if (!receive(photo.data(), photo.size()) || !receive(target.data(), target.size())) return 2;

  const auto start = std::chrono::steady_clock::now();
  Trainer trainer(shape, photo.data(), target.data(), job.threads);
  answer(answers, PeerReady{seconds_since(start)});

  for (int32_t count; receive(&count, 1);) {
    std::vector<float> rates(count);
    if (!receive(rates.data(), rates.size())) return 2;
    for (float rate : rates) answer(answers, timed_step(trainer, rate));
  }
  return 0;
}

}  // namespace

}  // namespace bilateral_slice

int main() {
  try {
    return bilateral_slice::serve();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bilateral_slice_halide_peer: %s\n", error.what());
    return 1;
  }
}
