// stage_device.cpp -- directives for GPUs and accelerators. They are declared so that programs
// written for them build; code is generated for CPUs.
#include "frontend/stage.h"

namespace retrograde {

namespace {

std::string loops(std::initializer_list<VarOrRVar> vars) {
  std::string out;
  for (const VarOrRVar& var : vars) out += (out.empty() ? "" : ", ") + quoted(var.name());
  return out;
}

}  // namespace

void Stage::refuse_device(const std::string& asked, DeviceAPI device) const {
  unsupported(asked, "loops run on the CPU",
              text("stage ", quoted(name()), " is to run on ",
                   device == DeviceAPI::Hexagon ? "a Hexagon accelerator" : "a GPU",
                   ", and no code is generated for it"),
              "Use parallel, vectorize and tile instead");
}

Stage& Stage::gpu_threads(const VarOrRVar& x, DeviceAPI device) {
  refuse_device("map " + loops({x}) + " to GPU threads", device);
}
Stage& Stage::gpu_threads(const VarOrRVar& x, const VarOrRVar& y, DeviceAPI device) {
  refuse_device("map " + loops({x, y}) + " to GPU threads", device);
}
Stage& Stage::gpu_threads(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& z,
                          DeviceAPI device) {
  refuse_device("map " + loops({x, y, z}) + " to GPU threads", device);
}
Stage& Stage::gpu_lanes(const VarOrRVar& x, DeviceAPI device) {
  refuse_device("map " + loops({x}) + " to GPU lanes", device);
}
Stage& Stage::gpu_single_thread(DeviceAPI device) {
  refuse_device("run " + quoted(name()) + " on a single GPU thread", device);
}
Stage& Stage::gpu_blocks(const VarOrRVar& x, DeviceAPI device) {
  refuse_device("map " + loops({x}) + " to GPU blocks", device);
}
Stage& Stage::gpu_blocks(const VarOrRVar& x, const VarOrRVar& y, DeviceAPI device) {
  refuse_device("map " + loops({x, y}) + " to GPU blocks", device);
}
Stage& Stage::gpu_blocks(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& z,
                         DeviceAPI device) {
  refuse_device("map " + loops({x, y, z}) + " to GPU blocks", device);
}
Stage& Stage::gpu(const VarOrRVar& bx, const VarOrRVar& tx, DeviceAPI device) {
  refuse_device("map " + loops({bx, tx}) + " to a GPU", device);
}
Stage& Stage::gpu(const VarOrRVar& bx, const VarOrRVar& by, const VarOrRVar& tx,
                  const VarOrRVar& ty, DeviceAPI device) {
  refuse_device("map " + loops({bx, by, tx, ty}) + " to a GPU", device);
}
Stage& Stage::gpu(const VarOrRVar& bx, const VarOrRVar& by, const VarOrRVar& bz,
                  const VarOrRVar& tx, const VarOrRVar& ty, const VarOrRVar& tz, DeviceAPI device) {
  refuse_device("map " + loops({bx, by, bz, tx, ty, tz}) + " to a GPU", device);
}
Stage& Stage::gpu_tile(const VarOrRVar& x, const VarOrRVar&, const VarOrRVar&, const Expr&,
                       TailStrategy, DeviceAPI device) {
  refuse_device("tile " + loops({x}) + " for a GPU", device);
}
Stage& Stage::gpu_tile(const VarOrRVar& x, const VarOrRVar&, const Expr&, TailStrategy,
                       DeviceAPI device) {
  refuse_device("tile " + loops({x}) + " for a GPU", device);
}
Stage& Stage::gpu_tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar&, const VarOrRVar&,
                       const VarOrRVar&, const VarOrRVar&, const Expr&, const Expr&, TailStrategy,
                       DeviceAPI device) {
  refuse_device("tile " + loops({x, y}) + " for a GPU", device);
}
Stage& Stage::gpu_tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar&, const VarOrRVar&,
                       const Expr&, const Expr&, TailStrategy, DeviceAPI device) {
  refuse_device("tile " + loops({x, y}) + " for a GPU", device);
}
Stage& Stage::gpu_tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& z, const VarOrRVar&,
                       const VarOrRVar&, const VarOrRVar&, const VarOrRVar&, const VarOrRVar&,
                       const VarOrRVar&, const Expr&, const Expr&, const Expr&, TailStrategy,
                       DeviceAPI device) {
  refuse_device("tile " + loops({x, y, z}) + " for a GPU", device);
}
Stage& Stage::gpu_tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& z, const VarOrRVar&,
                       const VarOrRVar&, const VarOrRVar&, const Expr&, const Expr&, const Expr&,
                       TailStrategy, DeviceAPI device) {
  refuse_device("tile " + loops({x, y, z}) + " for a GPU", device);
}
Stage& Stage::hexagon(const VarOrRVar& x) {
  refuse_device("run the loop " + loops({x}) + " on a Hexagon accelerator", DeviceAPI::Hexagon);
}

}  // namespace retrograde
