// demosaicker.h -- a demosaicking method, compiled once for images of all sizes.
#pragma once

#include <retrograde/retrograde.h>

#include <memory>
#include <string>
#include <vector>

#include "weights.h"

namespace demosaic {

class Demosaicker {
 public:
  static Demosaicker bilinear(int threads);
  static Demosaicker ahd(int threads);
  static Demosaicker relaxed(const Weights& weights, int threads);

  const std::string& name() const { return name_; }
  // Sets other weights of the same shape, for the relaxed method.
  void use(const Weights& weights);

  // Converts [height, width], R G over G B, to planes [3, height, width]. The mosaic is mirrored at its borders. Throws
  // retrograde::Error.
  std::vector<float> run(std::vector<float>& mosaic, int width, int height);
  // The median time of several runs into the same memory, in milliseconds per million pixels.
  double ms_per_megapixel(std::vector<float>& mosaic, int width, int height, int runs);

 private:
  Demosaicker(std::string name, int threads);
  void compile(lang::Func image);
  void run_into(std::vector<float>& mosaic, int width, int height, std::vector<float>& planes);

  std::string name_;
  int threads_;
  lang::ImageParam mosaic_{lang::Float(32), 2, "mosaic"};
  std::shared_ptr<Weights> weights_;
  std::shared_ptr<Relaxed> model_;
  lang::Pipeline pipeline_;
};

// This machine's threads and caches, for the autoscheduler.
lang::MachineParams machine_of(int threads);
// Schedules the pipeline for this machine and compiles it.
void schedule_and_compile(lang::Pipeline& pipeline, int threads);
// "relaxed 9 5x5"
std::string name_of(const Shape& shape);

}  // namespace demosaic
