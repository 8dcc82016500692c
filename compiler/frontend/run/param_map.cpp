// param_map.cpp -- checks that a value fits its parameter.
#include "frontend/run/param_map.h"

namespace retrograde {

const ParamMap& ParamMap::empty_map() {
  static const ParamMap empty;
  return empty;
}

const ParamMap::Entry* ParamMap::find(
    const std::shared_ptr<graph::ParameterContents>& parameter) const {
  return ir::find_or_null(entries_, parameter);
}

ir::Scalar ParamMap::checked(const graph::ParameterContents& parameter, const ir::Scalar& value) {
  return frontend::converted_scalar(parameter, value);
}

Buffer<> ParamMap::checked(const ImageParam& image, const Buffer<>& buffer) {
  image.name();  // throws if it is undefined
  if (buffer.defined()) frontend::check_image(*image.parameter(), buffer);
  return buffer;
}

}  // namespace retrograde
