// prescription.cpp -- see prescription.h.
#include "prescription.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/json_files.h"
#include "diagnostics/error.h"
#include "paraxial.h"

namespace lens {

using nlohmann::json;
using retrograde::quoted;
using retrograde::text;

namespace {

[[noreturn]] void refuse_lens(const std::string& asked, const std::string& rule,
                              const std::string& evidence,
                              const std::string& instead = "Mend the prescription") {
  retrograde::call_error(asked, rule, evidence, instead);
}

// A number of the JSON; if the key is present, its value must be a number.
double number(const std::string& asked, const json& from, const char* key, double otherwise) {
  const auto found = from.find(key);
  if (found == from.end() || found->is_null()) return otherwise;
  if (!found->is_number())
    refuse_lens(asked, text(quoted(key), " must be a number"), text("it is ", found->dump()));
  return found->get<double>();
}

// Reads "n_D" with "n_F", as in old patents, or "n_d" with "V_d", as in newer ones.
void read_medium(const std::string& asked, const json& from, Surface& to) {
  if (from.contains("n_D")) {
    const double n_D = number(asked, from, "n_D", 1), n_F = number(asked, from, "n_F", n_D);
    to.dispersion = (n_F - n_D) / (cauchy_term(line_F) - cauchy_term(line_D));
    to.index = n_D - to.dispersion * cauchy_term(line_D);
    return;
  }
  to.index = number(asked, from, "n_d", 1);
  const double abbe = number(asked, from, "V_d", 0);
  if (abbe != 0)
    to.dispersion = (to.index - 1) / abbe / (cauchy_term(line_F) - cauchy_term(line_C));
}

Surface read_surface(const std::string& asked, const json& from, double scale) {
  if (!from.is_object())
    refuse_lens(asked, "a surface is an object with a radius, a spacing ...", from.dump());
  Surface to;
  const double radius = number(asked, from, "radius", 0);  // null, 0 or missing: a plane
  to.curvature = radius == 0 ? 0 : 1 / (scale * radius);
  to.conic = number(asked, from, "conic", 0);
  to.spacing = scale * number(asked, from, "spacing", NAN);
  to.semi_aperture = scale * number(asked, from, "semi_aperture", 0);
  to.stop = from.value("stop", json(false)) == json(true);
  read_medium(asked, from, to);
  return to;
}

json parse_file(const std::string& asked, const std::filesystem::path& path) {
  json found;
  const std::string wrong = apps::read_json(path, found);
  if (!wrong.empty())
    refuse_lens(asked, "a prescription is JSON, as in apps/lens/prescriptions", wrong,
                "Give a prescription");
  return found;
}

Lens lens_of(const std::string& asked, const json& from) {
  if (!from.is_object() || !from.contains("surfaces") || !from["surfaces"].is_array())
    refuse_lens(asked, "a prescription has a list of \"surfaces\"", "there is none");
  Lens lens;
  const auto words = [&](const char* key, const std::string& otherwise) {
    return from.contains(key) && from[key].is_string() ? from[key].get<std::string>() : otherwise;
  };
  lens.name = words("name", "a lens");
  lens.source = words("source", "");
  lens.f_number = number(asked, from, "f_number", 8);
  lens.half_field_degrees = number(asked, from, "half_field_degrees", 20);
  const double scale = number(asked, from, "scale", 1);
  for (const json& surface : from["surfaces"])
    lens.surfaces.push_back(read_surface(asked, surface, scale));
  return lens;
}

// Checks one surface and the medium behind it.
void check_surface(const Lens& lens, size_t k, const std::string& asked) {
  const Surface& s = lens.surfaces[k];
  const std::string which = text("surface ", k + 1);
  const double all[] = {s.curvature, s.conic, s.spacing, s.index, s.dispersion, s.semi_aperture};
  if (!std::all_of(std::begin(all), std::end(all), [](double v) { return std::isfinite(v); }))
    refuse_lens(asked, "every number must be finite, and every spacing given but the last",
                text(which, " has one that is not"));
  if (s.spacing < 0)
    refuse_lens(asked, "a spacing is not negative", text(which, " has ", s.spacing, " mm"));
  if (s.index < 1 || s.index > 4)
    refuse_lens(asked, "an index lies between 1 and 4", text(which, " has ", s.index));
  if (s.semi_aperture < 0 || !std::isfinite(sag(s, s.semi_aperture)))
    refuse_lens(
        asked, "a rim lies within the surface's equator",
        text(which, ", of radius ", 1 / s.curvature, " mm, has its rim at ", s.semi_aperture));
  if (s.stop && (s.curvature != 0 || s.index != 1))
    refuse_lens(asked, "the stop is a plane in air", text(which, " is not"));
}

void check_gap(const Lens& lens, size_t k, const std::string& asked) {
  const Surface &a = lens.surfaces[k], &b = lens.surfaces[k + 1];
  const double h = std::min(a.semi_aperture, b.semi_aperture);
  const double at_rim = a.spacing + sag(b, h) - sag(a, h);
  if (h > 0 && at_rim < 0)
    refuse_lens(
        asked, "surfaces do not cross within their rims",
        text("surfaces ", k + 1, " and ", k + 2, " overlap by ", -at_rim, " mm at height ", h));
}

}  // namespace

size_t Lens::stop() const {
  for (size_t k = 0; k < surfaces.size(); ++k) {
    if (surfaces[k].stop) return k;
  }
  return surfaces.size();
}

double Lens::length() const {
  double sum = 0;
  for (const Surface& surface : surfaces) sum += surface.spacing;
  return sum;
}

double Lens::index(size_t surface, double wavelength) const {
  return surfaces[surface].index + surfaces[surface].dispersion * cauchy_term(wavelength);
}

double cauchy_term(double wavelength) {
  return 1 / (wavelength * wavelength) - 1 / (line_d * line_d);
}

double sag(const Surface& surface, double h) {
  const double c = surface.curvature, inside = 1 - (1 + surface.conic) * c * c * h * h;
  return c * h * h / (1 + std::sqrt(inside));
}

void check_lens(const Lens& lens, const std::string& asked) {
  const size_t count = lens.surfaces.size();
  if (count < 2 || count > 60)
    refuse_lens(asked, "a lens has 2 to 60 surfaces", text("it has ", count));
  if (lens.stop() == count) refuse_lens(asked, "one surface is the stop", "none is");
  if (!(lens.f_number >= 0.5 && lens.f_number <= 1000))
    refuse_lens(asked, "an F-number lies between 0.5 and 1000", text("it is ", lens.f_number));
  if (!(lens.half_field_degrees >= 0 && lens.half_field_degrees <= 60))
    refuse_lens(asked, "half a field lies between 0 and 60 degrees",
                text("it is ", lens.half_field_degrees));
  for (size_t k = 0; k < count; ++k) check_surface(lens, k, asked);
  for (size_t k = 0; k + 1 < count; ++k) check_gap(lens, k, asked);
  const Paraxial p = paraxial(lens);
  if (!(p.power > 0) || !(p.back_focus > 0))
    refuse_lens(asked, "a lens forms a real image behind it",
                text("its power is ", p.power, " per mm, its back focus ", p.back_focus, " mm"));
}

Lens read_lens(const std::filesystem::path& path) {
  const std::string asked = text("use the lens of ", quoted(path.string()));
  Lens lens = lens_of(asked, parse_file(asked, path));
  if (!lens.surfaces.empty() && std::isnan(lens.surfaces.back().spacing))
    lens.surfaces.back().spacing = std::max(paraxial(lens).back_focus, 0.0);
  check_lens(lens, asked);
  return lens;
}

json to_json(const Lens& lens) {
  json surfaces = json::array();
  for (const Surface& s : lens.surfaces) {
    json one = {{"radius", s.curvature == 0 ? json(nullptr) : json(1 / s.curvature)},
                {"spacing", s.spacing}};
    if (s.conic != 0) one["conic"] = s.conic;
    if (s.semi_aperture > 0) one["semi_aperture"] = s.semi_aperture;
    if (s.stop) one["stop"] = true;
    if (s.index != 1) one["n_d"] = s.index;
    if (s.dispersion != 0)
      one["V_d"] = (s.index - 1) / s.dispersion / (cauchy_term(line_F) - cauchy_term(line_C));
    surfaces.push_back(one);
  }
  return {{"name", lens.name},
          {"source", lens.source},
          {"f_number", lens.f_number},
          {"half_field_degrees", lens.half_field_degrees},
          {"surfaces", surfaces}};
}

}  // namespace lens
