// drawing.h -- the data that draw_lens.py needs to draw a lens: outlines, rays, points of spots.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "scene.h"

namespace lens {

// `name` becomes part of the picture's file name.
nlohmann::json drawing_of(const Scene& scene, const Lens& lens, const std::string& name,
                          const std::string& title);

}  // namespace lens
