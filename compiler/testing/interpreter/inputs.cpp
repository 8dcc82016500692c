#include "testing/interpreter/inputs.h"

#include <HalideRuntime.h>

#include "diagnostics/error.h"
#include "ir/buffer_metadata.h"
#include "ir/lists.h"

namespace retrograde::oracle {

using graph::ParameterContents;

namespace {

const halide_buffer_t& buffer_of(const ParameterContents& image) {
  if (!image.buffer || !image.buffer->host)
    call_error("interpret with image " + quoted(image.name), "every image needs a host buffer");
  return *image.buffer;
}

}  // namespace

Value Inputs::value_of(const ParameterContents& parameter) {
  if (!parameter.value) {
    call_error("interpret with parameter " + quoted(parameter.name),
               "every parameter needs a value");
  }
  return {*parameter.value};
}

Value Inputs::metadata(const ParameterContents& image, const ir::Variable& variable) {
  const auto name = ir::parse_metadata_name(variable.name);
  RETROGRADE_ASSERT(name, quoted(variable.name), " is no metadata of ", quoted(image.name));
  const halide_dimension_t& dim = buffer_of(image).dim[name->dimension];
  const int value = name->what == ir::Metadata::Min      ? dim.min
                    : name->what == ir::Metadata::Extent ? dim.extent
                                                         : dim.stride;
  return {ir::Scalar::of_int(variable.type, value)};
}

Value Inputs::read(const ParameterContents& image, const Point& point) {
  const halide_buffer_t& buffer = buffer_of(image);
  if (!is_inside(region_of(buffer), point)) {
    call_error("interpret", "an image is read inside of its bounds",
               quoted(image.name) + " is read at " + to_string(point));
  }
  touched_[&image].include(point);
  return {read_element(buffer, point)};
}

Region Inputs::touched(const ParameterContents& image) const {
  const Hull* hull = ir::find_or_null(touched_, &image);
  return hull ? hull->region() : Region{};
}

}  // namespace retrograde::oracle
